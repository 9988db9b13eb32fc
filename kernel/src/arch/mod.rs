//! What the kernel needs of a machine: this contract, which each port fulfils under the same names. A port is
//! one folder.
//!
//! | name | contract |
//! |---|---|
//! | `disable_interrupts`, `enable_interrupts` | begin and end a critical section of a task; both are compiler barriers |
//! | `irq_window` | pending interrupts occur between two critical sections of a task that follow each other |
//! | `isr_window` | pending interrupts occur between two critical sections of an ISR; they nest on its stack |
//! | `critical` | a critical section where the caller's context is not known; interrupts stay as they were |
//! | `switch` | saves the running task's context and resumes the head; returns when the task runs again |
//! | `switch_from_call` | the same where a switch is rare: it preserves what a call does |
//! | `begin` | masks interrupts for `run`, which the kernel starts with, if the port starts it so |
//! | `may_block` | called where the running task blocks; fails if the port could not go on with it |
//! | `run_head` | resumes the head; what ran is forgotten |
//! | `IDLE_CONTEXT` | the idle task's `stack_pointer`: it has no context, and begins anew each time |
//! | `LINK_MARK` | what makes the highest byte of an object's address positive, if it is not by itself: see `link` |
//! | `fits`, `init_context` | a task's body and its first context on a new stack |
//! | `when_dropped` | what is done where a task is dropped in its midst, if the port drops tasks |
//! | `stack` | where a task's stack lies, if the port knows; its unused bytes hold the watermark |
//! | `load`, `flash_static!` | tables in program memory: see [`flash`](mod@crate::flash) |
//! | `need_tick` | without a tick, code that waits for one does not link, if the port can tell |
//! | `clock` | the counter of the feature `cpu-time` |
//! | `public` | what the port offers to users beside the kernel's API |
//!
//! A port also starts the kernel, and calls `timer::count_tick` and `timer::expire`, or does as they do.

#[cfg(target_arch = "avr")]
mod avr;
#[cfg(target_arch = "avr")]
pub use avr::*;
#[cfg(target_arch = "avr")]
pub mod public {}

#[cfg(not(target_arch = "avr"))]
pub mod host;
#[cfg(not(target_arch = "avr"))]
pub(crate) use host::*;
#[cfg(not(target_arch = "avr"))]
pub mod public {
    pub use super::host;
}
