//! What remains of a history that disagrees, without the steps that do not matter.

use std::vec;

use crate::call::{Setup, Step};
use crate::lockstep::{Disagreement, Script, play};
use crate::reference::Reference;

/// The steps of a history, as far as they are possible where they come.
struct Replay(vec::IntoIter<Step>);

impl Script for Replay {
    fn next(&mut self, reference: &Reference) -> Option<Step> {
        self.0.find(|step| match step {
            Step::Call(call) => reference.permits(*call),
            Step::Interrupt(_) | Step::Ticks(_) => true,
        })
    }
}

/// Leaves out halves, quarters and so on down to single steps, as long as something disagrees without them.
pub fn shorten(real: &Setup, supposed: &Setup, mut disagreement: Disagreement) -> Disagreement {
    let mut length = disagreement.history.len();
    while length > 0 {
        let mut start = 0;
        while start < disagreement.history.len() {
            let steps = disagreement.history.iter().map(|(_, step)| step.clone());
            let rest = steps.enumerate().filter(|(index, _)| !(start..start + length).contains(index));
            let rest: Vec<_> = rest.map(|(_, step)| step).collect();
            match play(real, supposed, Replay(rest.into_iter())).1 {
                Err(shorter) if shorter.history.len() < disagreement.history.len() => disagreement = shorter,
                _ => start += length,
            }
        }
        length /= 2;
    }
    disagreement
}
