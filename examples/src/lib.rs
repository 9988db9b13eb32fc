//! What the examples share, so that each shows one thing.
#![no_std]
#![cfg(target_arch = "avr")]

pub mod timer2;

use core::convert::Infallible;

use board::debug::{halt, mark};

/// Prints a line to the on-chip debugger, which simavr shows. It takes no device and blocks nobody, so that a
/// task and an interrupt may print alike.
///
/// Formats as [`ufmt`] does, which is small; the text itself lies in RAM.
#[macro_export]
macro_rules! println {
    ($($argument:tt)*) => {{
        let Ok(()) = ufmt::uwriteln!(&mut $crate::Debugger, $($argument)*);
    }};
}

/// Where [`println!`](crate::println!) writes to.
pub struct Debugger;

impl ufmt::uWrite for Debugger {
    type Error = Infallible;

    fn write_str(&mut self, text: &str) -> Result<(), Infallible> {
        text.bytes().for_each(mark);
        Ok(())
    }
}

/// Says so if a task did not start.
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
