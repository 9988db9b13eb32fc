//! The interrupt sweep: it raises an interrupt at every instruction boundary of every path through the
//! kernel, and checks the conditions that must hold at each.
//!
//! The images `sweep_*` run the paths; their module `sweep` says what a path is. For each boundary of a path
//! the sweep brings the MCU there, raises interrupts, and runs to the end of the path's audit. A run is good
//! when
//! - the path's marks come in the order in which they come without these interrupts, and the audit finds
//!   nothing wrong;
//! - each interrupted task continues with every register as it was, and is then the task that should run:
//!   tasks that the interrupt woke above it have run before;
//! - the kernel's lists are whole at every mark and at every return from an interrupt;
//! - SP never leaves the stack in use, and no task's stack holds more than one context of an interrupt.
//!
//! While interrupts are masked, a raised interrupt waits: it occurs at the first place where it can.

mod all;
mod interruption;
mod kernel;
mod paths;
mod watch;

pub use all::{Extent, Total, sweep_all};
pub use interruption::{Findings, Order, Share, Subject, sweep_path};
pub use paths::{PROGRAMS, Program};
