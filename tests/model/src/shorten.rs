//! Reduces a script that disagrees to the steps that matter.

use std::{iter, vec};

use crate::referee::{Disagreement, Played, Script};
use crate::reference::Reference;
use crate::step::{Handler, Interruption, Step};

/// The steps of a script; a step that is not possible where it comes is skipped.
pub struct Replay(vec::IntoIter<Step>);

impl Replay {
    pub fn new(steps: Vec<Step>) -> Self {
        Replay(steps.into_iter())
    }
}

impl Script for Replay {
    fn next(&mut self, reference: &Reference) -> Option<Step> {
        self.0.find(|step| match step {
            Step::Call(call, _) => reference.permits(*call),
            Step::Silence(_) => reference.running().is_none(),
            Step::Interrupt(_) => true,
        })
    }
}

/// Leaves out steps and parts of steps, as long as the rest still disagrees. `play` plays the rest.
pub fn shorten(
    disagreement: Box<Disagreement>,
    play: impl FnMut(Replay) -> Result<Played, Box<Disagreement>>,
) -> Box<Disagreement> {
    let mut shortest = Shortest { play, disagreement };
    loop {
        let size = size(shortest.disagreement.steps());
        shortest.leave_out_steps();
        shortest.simplify_steps();
        if size == self::size(shortest.disagreement.steps()) {
            return shortest.disagreement;
        }
    }
}

/// The shortest script so far.
struct Shortest<P> {
    play: P,
    disagreement: Box<Disagreement>,
}

impl<P: FnMut(Replay) -> Result<Played, Box<Disagreement>>> Shortest<P> {
    fn steps(&self) -> Vec<Step> {
        self.disagreement.steps().cloned().collect()
    }

    /// Plays `steps`. If they disagree too, they become the shortest script. Returns whether they did.
    fn becomes(&mut self, steps: Vec<Step>) -> bool {
        match (self.play)(Replay::new(steps)) {
            Err(other) if size(other.steps()) < size(self.disagreement.steps()) => {
                self.disagreement = other;
                true
            }
            _ => false,
        }
    }

    /// Leaves out the whole, then halves, quarters and so on, down to single steps.
    fn leave_out_steps(&mut self) {
        let lengths = iter::successors(Some(self.steps().len()), |length| Some(length / 2));
        for length in lengths.take_while(|&length| length > 0) {
            let mut start = 0;
            while start < self.steps().len() {
                let mut steps = self.steps();
                steps.drain(start..steps.len().min(start + length));
                if !self.becomes(steps) {
                    start += length;
                }
            }
        }
    }

    fn simplify_steps(&mut self) {
        let mut index = 0;
        while let Some(step) = self.steps().get(index) {
            let becomes_so = simpler(step).into_iter().any(|simpler| {
                let mut steps = self.steps();
                steps[index] = simpler;
                self.becomes(steps)
            });
            if !becomes_so {
                index += 1;
            }
        }
    }
}

fn size<'a>(steps: impl IntoIterator<Item = &'a Step>) -> usize {
    let of_step = |step: &Step| match step {
        Step::Call(_, Some(interruption)) => 1 + size_of_interruption(interruption),
        Step::Interrupt(handler) => 1 + size_of_handler(handler),
        Step::Call(_, None) | Step::Silence(_) => 1,
    };
    steps.into_iter().map(of_step).sum()
}

fn size_of_interruption(interruption: &Interruption) -> usize {
    size_of_handler(&interruption.handler) + interruption.then.as_deref().map_or(0, size_of_interruption)
}

fn size_of_handler(handler: &Handler) -> usize {
    match handler {
        Handler::Calls(calls) => calls.len(),
        Handler::Tick(None) => 1,
        Handler::Tick(Some(interruption)) => 1 + size_of_interruption(interruption),
    }
}

fn simpler(step: &Step) -> Vec<Step> {
    match step {
        Step::Call(call, Some(interruption)) => simpler_interruptions(interruption)
            .into_iter()
            .map(|interruption| Step::Call(*call, interruption))
            .collect(),
        Step::Interrupt(handler) => simpler_handlers(handler).into_iter().map(Step::Interrupt).collect(),
        Step::Call(_, None) | Step::Silence(_) => Vec::new(),
    }
}

/// No interruption, interruptions with a simpler handler, and those with fewer others after them.
fn simpler_interruptions(interruption: &Interruption) -> Vec<Option<Interruption>> {
    let handlers = simpler_handlers(&interruption.handler).into_iter();
    let with_handler = handlers.map(|handler| Some(Interruption { handler, ..interruption.clone() }));
    let thens = interruption.then.as_deref().map(simpler_interruptions).unwrap_or_default().into_iter();
    let with_then = thens.map(|then| Some(Interruption { then: then.map(Box::new), ..interruption.clone() }));
    iter::once(None).chain(with_handler).chain(with_then).collect()
}

/// Handlers with one call less.
fn simpler_handlers(handler: &Handler) -> Vec<Handler> {
    let calls = match handler {
        Handler::Calls(calls) => calls,
        Handler::Tick(None) => return Vec::new(),
        Handler::Tick(Some(interruption)) => {
            let interruptions = simpler_interruptions(interruption).into_iter();
            return interruptions.map(|interruption| Handler::Tick(interruption.map(Box::new))).collect();
        }
    };
    let without = |index| {
        let mut calls = calls.clone();
        calls.remove(index);
        Handler::Calls(calls)
    };
    (0..calls.len()).map(without).collect()
}
