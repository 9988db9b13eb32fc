//! Every script up to a length, one after the other.

use std::iter;

use kernel::Priority;

use crate::call::{Call, Handler, Setup, Step, Strike};
use crate::lockstep::Script;
use crate::reference::Reference;

/// All scripts of so many steps. They are told apart by which of the possible steps they take each time, and they come in
/// the order of these numbers, as an odometer counts.
pub struct Exhaustive {
    length: usize,
    /// All that can ever happen.
    steps: Vec<Step>,
    has_struck: bool,
    wheels: Vec<Wheel>,
    /// The next wheel to be read.
    at: usize,
    /// How many scripts have been played.
    pub played: u64,
}

struct Wheel {
    choice: usize,
    choices: usize,
}

impl Exhaustive {
    /// All scripts of `length` steps, on the objects of [`setup`].
    pub fn new(length: usize) -> Self {
        let calls =
            CALLS.into_iter().filter(|call| !matches!(call, Call::Make { .. } | Call::SendMade { .. }));
        Self::of(length, calls.map(|call| Step::Call(call, None)))
    }

    /// The same, where an interrupt may strike inside of one call in each. To make a message and to send it are two calls here.
    pub fn with_strikes(length: usize) -> Self {
        let calls = CALLS.into_iter().filter(|call| !matches!(call, Call::Send { .. }));
        Self::of(length, calls.flat_map(|call| strikes().map(move |strike| Step::Call(call, strike))))
    }

    fn of(length: usize, calls: impl Iterator<Item = Step>) -> Self {
        let steps = calls.chain(handlers().map(Step::Interrupt)).collect();
        Exhaustive { length, steps, has_struck: false, wheels: Vec::new(), at: 0, played: 0 }
    }

    /// What can happen in this state.
    fn possible_steps(&self, reference: &Reference) -> impl Iterator<Item = &Step> {
        self.steps.iter().filter(|step| match step {
            Step::Call(_, Some(_)) if self.has_struck => false,
            Step::Call(call, _) => reference.permits(*call),
            _ => true,
        })
    }
}

impl Script for Exhaustive {
    fn next(&mut self, reference: &Reference) -> Option<Step> {
        if self.at == self.length {
            return None;
        }
        if self.at == self.wheels.len() {
            self.wheels.push(Wheel { choice: 0, choices: self.possible_steps(reference).count() });
        }
        let step = self.possible_steps(reference).nth(self.wheels[self.at].choice)?.clone();
        self.has_struck |= matches!(step, Step::Call(_, Some(_)));
        self.at += 1;
        Some(step)
    }

    fn goes_on(&mut self) -> bool {
        self.played += 1;
        self.at = 0;
        self.has_struck = false;
        while let Some(mut wheel) = self.wheels.pop() {
            wheel.choice += 1;
            if wheel.choice < wheel.choices {
                self.wheels.push(wheel);
                return true;
            }
        }
        false
    }
}

/// Two semaphores, a mutex and a queue with room for one.
pub fn setup(priorities: [Priority; 3], ceiling: Priority) -> Setup {
    Setup {
        priorities: priorities.to_vec(),
        started: priorities.len(),
        semaphores: vec![0, 0],
        ceilings: vec![ceiling],
        rooms: vec![1],
        timers: 0,
    }
}

const CALLS: [Call; 14] = [
    Call::Wait { semaphore: 0 },
    Call::Wait { semaphore: 1 },
    Call::WaitTimeout { semaphore: 0, ticks: 1 },
    Call::Post { semaphore: 0 },
    Call::Post { semaphore: 1 },
    Call::Lock { mutex: 0 },
    Call::Unlock,
    Call::Make { value: 1 },
    Call::SendMade { queue: 0 },
    Call::Receive { queue: 0 },
    Call::ReceiveTimeout { queue: 0, ticks: 1 },
    Call::Yield,
    Call::Delay(1),
    Call::Send { queue: 0, value: 1 },
];

/// Each the one call of a handler.
const CALLS_OF_INTERRUPTS: [Call; 3] =
    [Call::Post { semaphore: 0 }, Call::Post { semaphore: 1 }, Call::Send { queue: 0, value: 2 }];

/// More masked sections than most calls have here.
const SECTIONS: usize = 6;

fn handlers() -> impl Iterator<Item = Handler> {
    CALLS_OF_INTERRUPTS.into_iter().map(|call| Handler::Calls(vec![call])).chain([Handler::Tick(None)])
}

/// No strike, or one of every kind.
fn strikes() -> impl Iterator<Item = Option<Strike>> {
    let strikes = (1..=SECTIONS)
        .flat_map(|sections| handlers().map(move |handler| Strike { sections, handler, then: None }));
    iter::once(None).chain(strikes.map(Some))
}
