//! The two-wire serial interface: packets between the two MCUs of a module by `Twi`, and other devices on the
//! same bus by `I2c`.
//!
//! Multi-master: either MCU sends as a master and receives as a slave. [`engine`] and [`transaction`] decide,
//! the interrupt obeys. Between TWINT being set and its being cleared the interface holds SCL low, so an
//! interrupt that comes late makes the transfer slow, never wrong.

pub mod engine;
#[cfg(target_arch = "avr")]
mod i2c;
#[cfg(target_arch = "avr")]
mod interface;
#[cfg(target_arch = "avr")]
#[doc(hidden)]
pub mod registers;
pub mod status;
#[cfg(target_arch = "avr")]
#[doc(hidden)]
pub mod stream;
pub mod transaction;
#[cfg(target_arch = "avr")]
mod wires;

#[cfg(target_arch = "avr")]
pub use i2c::{I2c, Master, status_changed_with_i2c};
#[cfg(target_arch = "avr")]
pub use interface::{Interface, PACKETS, Packets, Twi, status_changed, wake};
