//! The control flow of a program's functions: the successors of each instruction, and its duration.

use std::collections::BTreeMap;

use crate::registers::StackPointer;

/// An address and a stack pointer. An address that a function reaches with different stack pointers is
/// several places.
pub type Place = (u32, StackPointer);

/// An instruction, or two that are decoded as one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Node {
    /// Without the cycles that an edge adds; see [`timing::cycles`](crate::timing::cycles).
    pub cycles: Option<u32>,
    /// The places that may follow, and how many cycles more each takes. After a call: once it has returned.
    /// None follows `sleep`, after which an unknown time passes.
    pub next: Vec<(Place, u32)>,
    /// The place that follows `sleep`, once an interrupt has ended the sleep.
    pub wakes: Option<Place>,
    /// The start addresses of the functions of which it calls one.
    pub calls: Vec<u32>,
    /// Its effect on the interrupt flag.
    pub masking: Masking,
    /// The address in the data space that it [names](crate::effect::named_address).
    pub names: Option<u16>,
}

/// The effect of an instruction on the interrupt flag of SREG.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Masking {
    #[default]
    Nothing,
    /// `cli`, or a write to SREG that clears the flag.
    Masks,
    /// `sei`, `reti`, or a write to SREG that sets the flag.
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
