//! What the kernel needs of a machine. Each port provides the same few functions:
//!
//! - `disable_interrupts`, `enable_interrupts`: bracket what a task does to the kernel's state;
//! - `part_sections`: makes sure that interrupts strike between two such brackets;
//! - `mask_anywhere`: the same where the caller's context is not known;
//! - `switch`: saves the running task's context and takes up that of the head; returns when the task runs again;
//!   `switch_from_call` does the same where a switch is rare;
//! - `lay_body`, `lay_context`: lay a task's body and its first context on a new stack;
//! - a way to start: `run` on the AVR, [`host::run_for`] on the host.

#[cfg(target_arch = "avr")]
mod avr;
#[cfg(target_arch = "avr")]
pub use avr::*;

#[cfg(not(target_arch = "avr"))]
pub mod host;
#[cfg(not(target_arch = "avr"))]
pub(crate) use host::*;
