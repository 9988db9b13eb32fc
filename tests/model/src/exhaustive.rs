//! Every script up to a length, one after the other.

use std::iter;

use crate::call::Call;
use crate::referee::Script;
use crate::reference::Reference;
use crate::step::{Handler, Interruption, Step};
use crate::systems::System;

/// All scripts of `length` steps. A script is given by the number of the possible step that it takes each
/// time. Scripts come in the order of these numbers, as on an odometer.
pub struct Exhaustive {
    length: usize,
    /// All steps that can ever happen.
    steps: Vec<Step>,
    /// Whether the tasks leave after each script, and come back for the next.
    is_left: bool,
    has_interrupted: bool,
    wheels: Vec<Wheel>,
    /// The next wheel to be read.
    at: usize,
    /// How many scripts have been played.
    pub played: u64,
}

struct Wheel {
    choice: usize,
    /// The steps to choose from, by their numbers. They are found once: every script that comes here has
    /// begun with the same steps.
    possible: Vec<usize>,
}

impl Exhaustive {
    /// All scripts of `length` steps in `system`.
    pub fn new(system: &System, length: usize) -> Self {
        let calls =
            system.calls.iter().filter(|call| !matches!(call, Call::Make { .. } | Call::SendMade { .. }));
        Self::of(system, length, calls.map(|&call| Step::Call(call, None)))
    }

    /// The same, where an interrupt may occur inside of one call in each. Making a message and sending it are
    /// two calls here.
    pub fn with_interruptions(system: &System, length: usize) -> Self {
        let calls = system.calls.iter().filter(|call| !matches!(call, Call::Send { .. }));
        Self::of(system, length, calls.flat_map(|&call| interrupted(system, call)))
    }

    fn of(system: &System, length: usize, calls: impl Iterator<Item = Step>) -> Self {
        let steps = calls.chain(handlers(system).map(Step::Interrupt)).collect();
        let is_left = system.is_left;
        Exhaustive { length, steps, is_left, has_interrupted: false, wheels: Vec::new(), at: 0, played: 0 }
    }

    /// Goes on to the next script. Returns whether there is one.
    fn advance(&mut self) -> bool {
        self.played += 1;
        self.at = 0;
        self.has_interrupted = false;
        while let Some(mut wheel) = self.wheels.pop() {
            wheel.choice += 1;
            if wheel.choice < wheel.possible.len() {
                self.wheels.push(wheel);
                return true;
            }
        }
        false
    }

    /// Whether there is a script for another run after this one.
    pub fn wants_another_run(&mut self) -> bool {
        self.is_left && self.advance()
    }

    /// The numbers of the steps that can happen in this state.
    fn possible_steps(&self, reference: &Reference) -> Vec<usize> {
        let is_possible = |step: &Step| match step {
            Step::Call(_, Some(_)) if self.has_interrupted => false,
            Step::Call(call, _) => reference.permits(*call),
            _ => true,
        };
        (0..self.steps.len()).filter(|&number| is_possible(&self.steps[number])).collect()
    }
}

impl Script for Exhaustive {
    fn next(&mut self, reference: &Reference) -> Option<Step> {
        if self.at == self.length {
            return None;
        }
        if self.at == self.wheels.len() {
            self.wheels.push(Wheel { choice: 0, possible: self.possible_steps(reference) });
        }
        let Wheel { choice, possible } = &self.wheels[self.at];
        let step = self.steps[*possible.get(*choice)?].clone();
        self.has_interrupted |= matches!(step, Step::Call(_, Some(_)));
        self.at += 1;
        Some(step)
    }

    fn goes_on(&mut self) -> bool {
        !self.is_left && self.advance()
    }
}

/// An upper limit for the critical sections of the call here, as a rule.
fn sections(call: Call) -> usize {
    match call {
        Call::WaitForSeveral { .. } => 20,
        Call::RunJobs { .. } => 12,
        _ => 6,
    }
}

fn handlers(system: &System) -> impl Iterator<Item = Handler> {
    let calls = system.of_interrupts.iter().map(|&call| Handler::Calls(vec![call]));
    calls.chain(system.ticks.then_some(Handler::Tick(None)))
}

/// `call` without an interrupt, and with one of every kind at each place.
fn interrupted(system: &System, call: Call) -> impl Iterator<Item = Step> {
    let interruptions = (1..=sections(call))
        .flat_map(|after| handlers(system).map(move |handler| Interruption { after, handler, then: None }));
    iter::once(None).chain(interruptions.map(Some)).map(move |interruption| Step::Call(call, interruption))
}
