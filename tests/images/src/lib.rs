//! The common parts of all test images: marks that the simulator sees, an end, and a panic handler that makes
//! a mark.
#![no_std]
#![cfg(target_arch = "avr")]
#![cfg_attr(feature = "atmega128", feature(asm_experimental_arch))] // for the marks around measured stretches

#[cfg(feature = "atmega128")]
pub mod bench;
#[cfg(feature = "atmega128")]
pub mod flood;
pub mod sweep;
#[cfg(feature = "atmega128")]
pub mod traffic;

use board::debug::{self, mark};

/// The mark of a panic.
pub const PANIC: u8 = 0xee;

/// The mark of a task that did not start.
pub const NOT_STARTED: u8 = 0xed;

/// The mark of a stack that a task has overflowed. The two bytes of its address follow.
pub const STACK_OVERFLOW: u8 = 0xec;

#[cfg(feature = "stack-check")]
kernel::stack_overflow!(show_overflow);

#[cfg(feature = "stack-check")]
fn show_overflow(stack: usize) -> ! {
    mark(STACK_OVERFLOW);
    stack.to_le_bytes().into_iter().for_each(mark);
    finish()
}

/// Ends the test: simavr stops at a `sleep` with interrupts masked.
pub fn finish() -> ! {
    debug::halt()
}

/// Marks and ends the test if a task did not start.
pub fn start(started: Result<(), kernel::StartError>) {
    if started.is_err() {
        mark(NOT_STARTED);
        finish()
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    mark(PANIC);
    finish()
}
