//! A third serial line: a UART in software, of Timer3 and two external interrupts.
//!
//! The timer counts clocks, of which a bit has 417. Hardware does everything on which a bit's timing depends:
//!
//! - *Receiving.* The capture unit takes the time of each edge. The interrupt that follows has to read it
//!   within two bits: if a second edge has come by then, that was a bit after the first.
//! - *Sending.* A character is a series of pulses, low and then high. A compare unit makes both edges of
//!   each, at the clocks that its double-buffered registers hold (fast PWM up to OCR3A). The interrupt at the
//!   beginning of a pulse has to set the next one before the pulse ends, at least two bits later.
//!
//! The timer's own interrupts have lower priority than the tick, USART0 and the converter. Therefore both
//! pins are external interrupts as well, INT5 and INT7, which have priority over all of these. They wait for
//! at most one other handler, and a critical section behind it.
//!
//! The timer's unit B matches when no other character follows one, or at the end of a transmission. None of
//! the three vectors [enters the kernel](crate::deferred).
//!
//! Timer and pins do one thing at a time: the line is half duplex, and receives nothing while it sends. An
//! infrared dock would receive its own light.

use tasks::superbot::{BAUD, CLOCK_HZ};

pub mod decoder;
pub mod encoder;
#[cfg(target_arch = "avr")]
mod line;
#[cfg(target_arch = "avr")]
mod registers;

#[cfg(target_arch = "avr")]
pub use line::SoftUart;
#[cfg(target_arch = "avr")]
#[doc(hidden)]
pub use line::{PORT, character_ends, line_changes, line_rises, pulse_begins, sent};

/// A bit in clocks: 417.
pub const BIT: u16 = {
    let bit = (CLOCK_HZ + BAUD / 2) / BAUD;
    assert!(bit <= 0xffff / 12, "a character and more must fit the timer");
    bit as u16
};
