//! The kernel on the MCU against the reference of the host tests: the image `model` makes the calls of a
//! script, and an interrupt may come at any instruction boundary inside of them.
//!
//! The program stops at each mark. There the harness reads what the last call returned, asks the
//! [referee](::model::referee) whether that is right, and writes the next call into the mailbox of the task
//! that runs.
//!
//! Where an interrupt comes the harness knows, by the stack pointer, which task it preempts. The reference
//! then goes all ways in which things may stand inside of the calls of that task, and of those agrees one at
//! least with all that follows.

mod campaign;
mod chip;
mod lockstep;
mod sweep;

pub use campaign::{Campaign, Failure, Total, play_seed};
pub use chip::Subject;
pub use lockstep::{Counts, Player};
