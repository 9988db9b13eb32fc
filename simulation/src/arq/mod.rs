//! The ARQ of a link alone: two ends of the robot's own code over a line that loses, corrupts, duplicates,
//! delays and reflects, and ends that are reset. Every message arrives exactly once and in order, or its
//! sender is told: a [`Violation`] says that this did not hold.
//!
//! There is no clock: the caller that drives a [`Link`] chooses what happens next. [`drive`] does so by
//! chance.

mod chance;
mod line;

pub use chance::{Counts, Rates, drive, million_at_loss};
pub use line::{End, Event, Link, Number, Violation};
