//! Code that the examples share, so that each shows one thing.
#![no_std]
#![cfg(target_arch = "avr")]

pub mod timer2;

use core::convert::Infallible;

use board::debug::{halt, mark};

/// Prints a line to the on-chip debugger, which simavr shows. It needs no device and never blocks, so that
/// tasks and interrupts print in the same way.
///
/// Formats by [`ufmt`], which is small; the text itself lies in RAM.
#[macro_export]
macro_rules! println {
    ($($argument:tt)*) => {{
        let Ok(()) = ufmt::uwriteln!(&mut $crate::Debugger, $($argument)*);
    }};
}

/// The output of [`println!`](crate::println!).
pub struct Debugger;

impl ufmt::uWrite for Debugger {
    type Error = Infallible;

    fn write_str(&mut self, text: &str) -> Result<(), Infallible> {
        text.bytes().for_each(mark);
        Ok(())
    }
}

/// Reports that a task did not start, and halts then.
pub fn start(started: Result<(), kernel::StartError>) {
    if started.is_err() {
        println!("a stack is taken, or too small");
        halt()
    }
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    board::panic::record_and_reset(info)
}
