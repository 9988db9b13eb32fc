//! A message as one I2C transfer.
//!
//! ```text
//!   +--------+----+------+-------------------+-------+
//!   | length | to | from | payload, 0..=16 B | CRC-8 |
//!   +--------+----+------+-------------------+-------+
//!
//!   length      bits 4..0 bytes of payload; bits 7..6 its kind: 0 lasting, 1 latest, 2 datagram; bit 5 zero
//! ```
//!
//! I2C acknowledges each byte but does not check it, hence the CRC. Both addresses cross unchanged:
//! the two MCUs are one module, and to both "here" means that module.

use crate::counter::counters;
use crate::message::{Address, Kind, MAX_PAYLOAD, Message};

/// The most bytes of a transfer.
pub const MAX_PACKET: usize = 3 + MAX_PAYLOAD + 1;

/// The bits of the first byte that do not hold the kind.
const LENGTH: u8 = 0x3F;

/// Why a transfer is no message.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum PacketError {
    /// The transfer is not as long as its first byte says, or that byte is out of range.
    Length,
    Crc,
    /// `to` or `from` is no address.
    Address,
}

/// The message as bytes to transfer, laid out in `packet`.
pub fn encode<'p>(message: Message, packet: &'p mut [u8; MAX_PACKET]) -> &'p [u8] {
    let payload = message.payload();
    let header = [payload.len() as u8 | message.kind() as u8, message.to().byte(), message.from().byte()];
    let mut crc = Crc8::new();
    let mut slots = packet.iter_mut();
    for bytes in [&header[..], payload] {
        for (byte, slot) in bytes.iter().zip(&mut slots) {
            crc.update(*byte);
            *slot = *byte;
        }
    }
    if let Some(slot) = slots.next() {
        *slot = crc.value();
    }
    packet.get(..=header.len() + payload.len()).unwrap_or(&[])
}

/// The message in the bytes of one whole transfer.
pub fn decode(packet: &[u8]) -> Result<Message<'_>, PacketError> {
    let [length, to, from, payload @ .., _] = packet else {
        return Err(PacketError::Length);
    };
    let kind = Kind::of_byte(*length).ok_or(PacketError::Length)?;
    if usize::from(length & LENGTH) != payload.len() {
        return Err(PacketError::Length);
    }
    let mut crc = Crc8::new();
    for byte in packet {
        crc.update(*byte);
    }
    if !crc.is_confirmed() {
        return Err(PacketError::Crc);
    }
    let to = Address::from_byte(*to).ok_or(PacketError::Address)?;
    let from = Address::from_byte(*from).ok_or(PacketError::Address)?;
    Message::of_kind(to, from, payload, kind).map_err(|_| PacketError::Length)
}

/// CRC-8 of ITU-T I.432.1: polynomial 0x07, initial value 0, inverted by 0x55 so that a bus stuck
/// low does not read as a message of zeros.
struct Crc8(u8);

impl Crc8 {
    const fn new() -> Crc8 {
        Crc8(0)
    }

    /// Takes in one byte.
    ///
    /// The polynomial is x^8 + x^2 + x + 1, so x^8 leaves the remainder x^2 + x + 1. The product of a byte
    /// and that remainder reaches two bits above the byte, and those are reduced in the same way.
    const fn update(&mut self, byte: u8) {
        const fn times_x8(byte: u8) -> u8 {
            byte ^ byte << 1 ^ byte << 2
        }
        let quotient = self.0 ^ byte;
        self.0 = times_x8(quotient) ^ times_x8(quotient >> 7 ^ quotient >> 6);
    }

    const fn value(self) -> u8 {
        self.0 ^ 0x55
    }

    /// Whether the last byte taken in is the CRC of those before.
    const fn is_confirmed(&self) -> bool {
        // Then only the remainder of the CRC's inversion is left.
        self.0 == 0xAC
    }
}

counters! {
    /// The counts of a bridge, read out of RAM by the console, a debugger or the simulator. All wrap.
    pub struct BridgeCounters {
        /// Messages that crossed to the other MCU.
        messages_sent,
        /// Messages that came from the other MCU.
        messages_received,
        /// Transfers begun again after a NACK or a bus error.
        retries,
        /// Transfers that are no message: length, CRC or address.
        errors,
        /// Messages given up after the last repetition, as the other MCU refused them.
        gave_up,
        /// Messages for a task or dock that this MCU does not have.
        ignored,
        /// Messages lost for want of a buffer.
        no_buffer,
        /// Transfers that took too long, so that the bus had to be freed.
        freed,
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::dock::Dock;
    use crate::message::TaskCode;
    use std::vec::Vec;

    const TO: Address = Address::here(TaskCode::HORMONE);
    const FROM: Address = Address::beyond(Dock::Back, TaskCode::HORMONE);

    fn packet(message: Message) -> Vec<u8> {
        encode(message, &mut [0xEE; MAX_PACKET]).to_vec()
    }

    fn crc8(bytes: &[u8]) -> u8 {
        let mut crc = Crc8::new();
        for byte in bytes {
            crc.update(*byte);
        }
        crc.value()
    }

    #[test]
    fn crc_8_agrees_with_long_division() {
        for remainder in 0..=255 {
            for byte in 0..=255 {
                let mut crc = Crc8(remainder);
                crc.update(byte);
                let divided =
                    (0..8).fold(remainder ^ byte, |rest, _| rest << 1 ^ if rest >> 7 != 0 { 7 } else { 0 });
                assert_eq!(crc.0, divided);
            }
        }
    }

    #[test]
    fn crc_8_known_vectors() {
        assert_eq!(crc8(b"123456789"), 0xA1, "the catalogue's check value");
        assert_eq!(crc8(b""), 0x55);
    }

    #[test]
    fn the_longest_message_fills_a_packet() {
        let message = Message::new(TO, FROM, &[7; MAX_PAYLOAD]).unwrap();
        assert_eq!(packet(message).len(), MAX_PACKET);
    }

    #[test]
    fn the_layout_is_as_drawn() {
        let message = Message::new(TO, FROM, &[7, 8]).unwrap();
        let expected = [2, 0xE1, 0x21, 7, 8];
        assert_eq!(packet(message), [&expected[..], &[crc8(&expected)]].concat());
        let probe = Message::datagram(TO, FROM, &[]).unwrap();
        let expected = [0x80, 0xE1, 0x21];
        assert_eq!(packet(probe), [&expected[..], &[crc8(&expected)]].concat());
    }

    #[test]
    fn a_transfer_of_another_length_is_refused() {
        let bytes = packet(Message::new(TO, FROM, &[7, 8]).unwrap());
        for length in 0..bytes.len() {
            assert_eq!(decode(&bytes[..length]), Err(PacketError::Length));
        }
        assert_eq!(decode(&[&bytes[..], &[0]].concat()), Err(PacketError::Length));
        let mut too_long = Vec::from([MAX_PAYLOAD as u8 + 1, TO.byte(), FROM.byte()]);
        too_long.extend([0; MAX_PAYLOAD + 1]);
        too_long.push(crc8(&too_long));
        assert_eq!(decode(&too_long), Err(PacketError::Length));
        for reserved in [0x20, 0x60, 0xA0, 0xC0, 0xE0] {
            let covered = [reserved, TO.byte(), FROM.byte()];
            let bytes = [&covered[..], &[crc8(&covered)]].concat();
            assert_eq!(decode(&bytes), Err(PacketError::Length));
        }
    }

    #[test]
    fn what_is_no_address_is_refused() {
        for (to, from) in [(0xC0, FROM.byte()), (TO.byte(), 0xDF)] {
            let covered = [0, to, from];
            let bytes = [&covered[..], &[crc8(&covered)]].concat();
            assert_eq!(decode(&bytes), Err(PacketError::Address));
        }
    }

    #[test]
    fn a_stuck_bus_is_no_message() {
        for length in 0..=MAX_PACKET {
            assert!(decode(&[0x00; MAX_PACKET][..length]).is_err());
            assert!(decode(&[0xFF; MAX_PACKET][..length]).is_err());
        }
    }
}
