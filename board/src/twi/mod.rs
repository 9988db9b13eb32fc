//! The two-wire serial interface: packets between the two MCUs of a module, by I2C.
//!
//! Multi-master: either MCU sends as a master and receives as a slave. [`engine`] decides, the interrupt
//! obeys. Between TWINT being set and its being cleared the interface holds SCL low, so an interrupt that
//! comes late makes the transfer slow, never wrong.

pub mod engine;
#[cfg(target_arch = "avr")]
mod interface;

#[cfg(target_arch = "avr")]
pub use interface::{Interface, Twi, status_changed};
