//! The control flow of a program's functions: what can follow what, and how long each instruction takes.

use std::collections::BTreeMap;

use crate::registers::StackPointer;

/// A place and a stack pointer: how a function gets to a place with different stack pointers is kept apart.
pub type Place = (u32, StackPointer);

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
    /// The address in the data space that it [names](crate::effect::named_address).
    pub names: Option<u16>,
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
