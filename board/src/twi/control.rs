//! The bits of TWCR (ATmega128 datasheet, "Two-wire Serial Interface"), and their combinations.

/// The interface and its interrupt are on.
pub const ENABLED: u8 = 1 << 2 | 1 << 0; // TWEN, TWIE
/// The interface is on, and its status waits: it holds SCL low until it is answered.
pub const HELD: u8 = 1 << 2; // TWEN
/// Send a STOP as a master; release the bus otherwise.
pub const STOP: u8 = 1 << 4; // TWSTO
/// Send a START when the bus is free.
pub const START: u8 = 1 << 5; // TWSTA
/// Acknowledge.
pub const ACKNOWLEDGE: u8 = 1 << 6; // TWEA
/// There is a new status. Writing one clears it, and the interface continues.
pub const INTERRUPT: u8 = 1 << 7; // TWINT

/// The answer in the middle of a packet. A START that waits for the other MCU's packet is requested again
/// when that has ended.
pub const GO_ON: u8 = ENABLED | INTERRUPT | ACKNOWLEDGE;
