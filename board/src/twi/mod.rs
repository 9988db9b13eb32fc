//! The two-wire serial interface: packets between the two MCUs of a module by `Twi`, and other devices on the
//! same bus by `I2c`.
//!
//! Multi-master: either MCU sends as a master and receives as a slave. [`stream`], [`engine`] and
//! [`transaction`] decide, and the interrupt executes. From the setting of TWINT to its clearing the
//! interface holds SCL low, so a late interrupt makes a transfer slow, never wrong.

#[cfg_attr(not(target_arch = "avr"), expect(dead_code, reason = "the vector alone holds the bus"))]
mod control;
pub mod engine;
#[cfg(target_arch = "avr")]
mod i2c;
#[cfg(target_arch = "avr")]
mod interface;
#[cfg(target_arch = "avr")]
mod registers;
pub mod status;
pub mod stream;
pub mod transaction;
#[cfg(target_arch = "avr")]
mod under_way;
#[cfg(target_arch = "avr")]
mod wires;

#[cfg(target_arch = "avr")]
pub use i2c::{I2c, Master, status_changed_with_i2c};
#[cfg(target_arch = "avr")]
pub use interface::{Interface, Twi, serve, status_changed};
