//! The control flow of a program's functions: what can follow what, and how long each instruction takes.

use std::collections::BTreeMap;

use crate::program::Program;
use crate::{Annotations, Image, Problem};

pub use crate::program::{Found, Place};

/// An instruction, or two that are decoded as one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Node {
    /// Without what an edge adds; see [`timing::cycles`](crate::timing::cycles).
    pub cycles: Option<u32>,
    /// Where it may lead, and how many cycles more that takes. Behind a call: once that has come back.
    pub next: Vec<(Place, u32)>,
    /// Where the functions begin one of which it calls.
    pub calls: Vec<u32>,
    /// What it does to the flag that enables interrupts.
    pub masking: Masking,
}

/// What an instruction does to the flag that enables interrupts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Masking {
    #[default]
    Nothing,
    /// `cli`.
    Masks,
    /// `sei`, `reti`.
    Enables,
    /// SREG is read into a register, with the flag.
    Reads(u8),
    /// SREG is written from a register, as it was read.
    Restores(u8),
}

/// The instructions of a function, by place.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Flow {
    pub entry: Option<Place>,
    pub nodes: BTreeMap<Place, Node>,
}

/// The control flow of all functions that a program's tasks and interrupts reach, by where they begin.
/// Interrupts find the stack that `found` says.
///
/// # Errors
/// All that keeps a function from being followed.
pub fn functions(
    image: &Image,
    annotations: &Annotations,
    found: Found,
) -> Result<BTreeMap<u32, Flow>, Vec<Problem>> {
    let mut program = Program::new(image, annotations, found);
    let entries: Vec<_> = image.vectors().chain(image.tasks.iter().map(|task| task.entry)).collect();
    for entry in entries {
        program.function(entry);
    }
    if !program.problems.is_empty() {
        return Err(program.problems.into_iter().collect());
    }
    Ok(program.into_flows())
}
