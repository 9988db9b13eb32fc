//! The status codes of the two-wire serial interface, without the prescaler bits of TWSR (ATmega128
//! datasheet, "Two-wire Serial Interface", tables of status codes).

/// The bits of TWSR that are the status; the others set the prescaler.
pub const MASK: u8 = 0xf8;

/// An illegal START or STOP on the bus.
pub const BUS_ERROR: u8 = 0x00;
pub const START: u8 = 0x08;
pub const REPEATED_START: u8 = 0x10;
/// As a master: SLA+W is sent, and was acknowledged.
pub const ADDRESS_ACKNOWLEDGED: u8 = 0x18;
pub const ADDRESS_REFUSED: u8 = 0x20;
/// As a master: a byte is sent, and was acknowledged.
pub const DATA_ACKNOWLEDGED: u8 = 0x28;
pub const DATA_REFUSED: u8 = 0x30;
pub const ARBITRATION_LOST: u8 = 0x38;
/// As a master: SLA+R is sent, and was acknowledged.
pub const READ_ADDRESS_ACKNOWLEDGED: u8 = 0x40;
pub const READ_ADDRESS_REFUSED: u8 = 0x48;
/// As a master: a byte is read, and was acknowledged: another follows.
pub const DATA_READ: u8 = 0x50;
/// As a master: a byte is read, and was not acknowledged: it is the last.
pub const LAST_DATA_READ: u8 = 0x58;
/// As a slave: the own SLA+W was received.
pub const ADDRESSED: u8 = 0x60;
/// The same, from the winner of an arbitration.
pub const LOST_AND_ADDRESSED: u8 = 0x68;
/// The general call, which is ignored; its recognition is off.
pub const CALLED: u8 = 0x70;
pub const LOST_AND_CALLED: u8 = 0x78;
/// As a slave: a byte was received, and acknowledged.
pub const RECEIVED: u8 = 0x80;
/// As a slave: a byte was received, but not acknowledged; the slave is not addressed any more.
pub const RECEIVED_REFUSED: u8 = 0x88;
pub const CALL_RECEIVED: u8 = 0x90;
pub const CALL_RECEIVED_REFUSED: u8 = 0x98;
/// As a slave: a STOP or a repeated START.
pub const STOP: u8 = 0xa0;
/// As a slave: the own SLA+R was received: the other side wants to read, and gets ones.
pub const READ: u8 = 0xa8;
pub const LOST_AND_READ: u8 = 0xb0;
pub const READ_ACKNOWLEDGED: u8 = 0xb8;
pub const READ_REFUSED: u8 = 0xc0;
pub const READ_LAST: u8 = 0xc8;
