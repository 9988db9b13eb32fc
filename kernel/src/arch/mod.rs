//! The contract between the kernel and a port: each port provides these items under these names. A port is
//! one folder.
//!
//! | name | contract |
//! |---|---|
//! | `disable_interrupts`, `enable_interrupts` | begin and end a critical section of a task; both are compiler barriers |
//! | `irq_window` | lets pending interrupts occur between two consecutive critical sections of a task |
//! | `isr_window` | the same between two critical sections of an ISR; the interrupts nest on its stack |
//! | `critical` | a critical section for a caller without a context; restores the interrupt state |
//! | `switch` | saves the running task's context and resumes the head; returns when the task runs again |
//! | `switch_from_call` | the same where a switch is rare: preserves the registers that a call preserves |
//! | `begin` | masks interrupts for the first `run`; panics on a port that does not start the kernel by it |
//! | `may_block` | called where the running task blocks; fails if the port could not resume the task |
//! | `run_head` | resumes the head and discards the caller's context |
//! | `IDLE_CONTEXT` | the idle task's `stack_pointer`: it has no saved context, and starts over each time |
//! | `LINK_MARK` | makes the highest byte of a task's address positive; 0 if it always is: see `link` |
//! | `fits`, `init_context` | check and write a task's body and its first context on a new stack |
//! | `when_dropped` | runs a clean-up if the task is dropped in the middle of a call; a port may drop none |
//! | `stack` | the address range of a task's stack, if the port knows it; unused bytes hold the watermark |
//! | `load`, `flash_static!` | tables in program memory: see [`flash`](mod@crate::flash) |
//! | `need_tick` | code that waits for a tick does not link without one, if the port can tell |
//! | `clock` | the count of the clock of the feature `cpu-time` |
//! | `public` | items of the port for users, besides the kernel's API |
//!
//! A port also starts the kernel and drives the tick: it calls `timer::count_tick` and `timer::expire`, or
//! does the same itself.

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
