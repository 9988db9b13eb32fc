//! What the worker runs the robot for.

use serde::{Deserialize, Serialize};

use super::order::Reason;

/// The goal of the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Goal {
    /// Run to the next stop that gdb wants, or for one instruction.
    Forward { is_step: bool },
    /// Run to the first instruction at or after a cycle, and stop there for this reason.
    Reach { cycle: u64, reason: Reason },
    /// Find the last moment before the cycle `until` at which gdb wants to stop; for a step, that is any
    /// instruction. The search covers the run after the copy with the number `behind`.
    Search { until: u64, is_step: bool, behind: usize, found: Option<(u64, Reason)> },
}
