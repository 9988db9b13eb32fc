//! Compares the kernel on the MCU with the reference of the host tests: the image `model` makes the calls of
//! a script, and an interrupt may come at any instruction boundary inside of them.
//!
//! The program stops at each mark. There the harness reads the last call's outcome, asks the
//! [referee](::model::referee) whether it is right, and writes the next call into the mailbox of the running
//! task.
//!
//! When an interrupt comes, the stack pointer shows the harness which task it preempts. The reference then
//! follows all states that may hold inside of the calls of that task, and at least one of them must agree
//! with all that follows.

mod campaign;
mod chip;
mod lockstep;
mod sweep;

pub use campaign::{Campaign, Failure, Total, play_seed};
pub use chip::Subject;
pub use lockstep::{Counts, Player};
