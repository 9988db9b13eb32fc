//! The interrupt sweep: at every instruction boundary of every path through the kernel an interrupt, and what
//! must hold whatever it interrupts.
//!
//! The images `sweep_*` run the paths; their module `sweep` says what a path is. For each boundary of a path
//! the sweep takes the MCU to it, raises interrupts there, and runs on to the end of the path's audit. A run
//! is good when
//! - the path's marks come in the order in which they come without these interrupts, and the audit finds
//!   nothing wrong;
//! - each task that is interrupted goes on with every register as it was, and is then the one to run:
//!   whatever the interrupt woke above it has run before;
//! - the kernel's lists are whole at every mark and at every return from an interrupt;
//! - SP never leaves the stack in use, and no task's stack holds more than one context of an interrupt.
//!
//! Where interrupts are masked, one that is raised waits: it occurs at the first place where it can.

mod all;
mod interruption;
mod kernel;
mod paths;
mod watch;

pub use all::{Extent, Total, sweep_all};
pub use interruption::{Findings, Order, Share, Subject, sweep_path};
pub use paths::{PROGRAMS, Program};
