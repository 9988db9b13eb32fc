//! One frame, as it is before COBS and after.
//!
//! ```text
//!              +---------+-------+----+-------------------+-----------+
//!   data       | control | epoch | to | payload, 0..=16 B |  CRC-16   |
//!   datagram   | control | epoch | to | payload, 0..=16 B |  CRC-16   |
//!   ACK        | control | epoch |                        |  CRC-16   |
//!              +---------+-------+----+-------------------+-----------+
//!
//!   control     7  6   5          4       3   2  1  0
//!              kind | sequence | fresh | 0 | dock        kind: 1 data, 2 ACK, 3 datagram
//! ```
//!
//! - `dock` and `epoch` are the sender's [`Signature`]; `sequence` and `fresh` tell one
//!   message from the next ([`Label`]). Both bits are 0 in a datagram.
//! - An ACK repeats the control bits and the epoch of the frame it acknowledges, the dock included;
//!   only the kind differs. It thus names one frame of one sender. See [`super::arq`].
//! - `to` is an [`Address`] as the receiving module understands it: `Address::here(task)` from a
//!   well-behaved neighbour. Routing through a module is refused by its router.
//! - The CRC covers all before it and goes most significant byte first.
//!
//! COBS adds two bytes: a hormone of 2 payload bytes takes 9 on the wire, an ACK 6. At 38400 baud a
//! byte takes 260 us.

use super::cobs::{self, NotCobs, WireBuffer};
use super::crc::Crc16;
use super::signature::Signature;
use crate::dock::Dock;
use crate::message::{Address, MAX_PAYLOAD, TooLong};

/// The most bytes of a frame, before COBS.
pub const MAX_FRAME: usize = 3 + MAX_PAYLOAD + 2;

/// The kind stands in bits 7..6 of the control byte, in place here.
const KIND: u8 = 0xC0;
const DATA: u8 = 0x40;
const ACK: u8 = 0x80;
const DATAGRAM: u8 = 0xC0;

const SEQUENCE: u8 = 0x20;
const FRESH: u8 = 0x10;
/// Bit 3 and the dock: seen as one number, anything above 5 is no dock.
const DOCK: u8 = 0x0F;

/// What tells one message of a sender from the next. Repetitions bear the same label.
///
/// The sequence bit changes with each message that was acknowledged, the epoch with each that was
/// not.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub struct Label {
    pub signature: Signature,
    pub sequence: bool,
    /// Set from the sender's reset until its first message is acknowledged, so that what a sender
    /// says after a reset is new even if it comes upon an epoch that it had before.
    pub fresh: bool,
}

/// What goes over the wire in one piece.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Frame<'a> {
    /// A message under ARQ.
    Data { label: Label, to: Address, payload: &'a [u8] },
    /// Acknowledges the data frame that bears this label.
    Ack(Label),
    /// A message sent once and not acknowledged.
    Datagram { signature: Signature, to: Address, payload: &'a [u8] },
}

/// Why bytes are no frame. All count as errors of the link.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum FrameError {
    Cobs,
    /// Too short or too long for its kind.
    Length,
    Crc,
    /// No such kind or dock, or a bit is set that has no meaning.
    Control,
    /// `to` is no address.
    Address,
}

impl<'a> Frame<'a> {
    /// Puts the frame into `wire`, ready to transmit. Fails for a payload above [`MAX_PAYLOAD`]
    /// bytes; what is in `wire` then is not to be sent.
    pub fn encode(&self, wire: &mut WireBuffer) -> Result<(), TooLong> {
        let mut writer = Writer { wire, crc: Crc16::new() };
        writer.wire.begin();
        match *self {
            Frame::Data { label, to, payload } => {
                writer.header(DATA, label)?;
                writer.body(to, payload)?;
            }
            Frame::Ack(label) => writer.header(ACK, label)?,
            Frame::Datagram { signature, to, payload } => {
                writer.header(DATAGRAM, Label { signature, sequence: false, fresh: false })?;
                writer.body(to, payload)?;
            }
        }
        writer.finish()
    }

    /// Reads a frame from what came over the wire up to and including a delimiter, in place.
    pub fn decode(wire: &'a mut [u8]) -> Result<Frame<'a>, FrameError> {
        let bytes = cobs::decode(wire).map_err(|NotCobs| FrameError::Cobs)?;
        Self::from_bytes(bytes)
    }

    fn from_bytes(bytes: &'a [u8]) -> Result<Frame<'a>, FrameError> {
        let (covered, crc) = bytes.split_last_chunk::<2>().ok_or(FrameError::Length)?;
        let mut expected = Crc16::new();
        for byte in covered {
            expected.update(*byte);
        }
        if expected.value() != u16::from_be_bytes(*crc) {
            return Err(FrameError::Crc);
        }
        let [control, epoch, body @ ..] = covered else {
            return Err(FrameError::Length);
        };
        let dock = Dock::from_index(control & DOCK).ok_or(FrameError::Control)?;
        let label = Label {
            signature: Signature { dock, epoch: *epoch },
            sequence: control & SEQUENCE != 0,
            fresh: control & FRESH != 0,
        };
        match control & KIND {
            DATA => {
                let (to, payload) = read_body(body)?;
                Ok(Frame::Data { label, to, payload })
            }
            ACK if body.is_empty() => Ok(Frame::Ack(label)),
            ACK => Err(FrameError::Length),
            DATAGRAM if label.sequence || label.fresh => Err(FrameError::Control),
            DATAGRAM => {
                let (to, payload) = read_body(body)?;
                Ok(Frame::Datagram { signature: label.signature, to, payload })
            }
            _ => Err(FrameError::Control),
        }
    }
}

fn read_body(body: &[u8]) -> Result<(Address, &[u8]), FrameError> {
    let (to, payload) = body.split_first().ok_or(FrameError::Length)?;
    if payload.len() > MAX_PAYLOAD {
        return Err(FrameError::Length);
    }
    Ok((Address::from_byte(*to).ok_or(FrameError::Address)?, payload))
}

/// Writes a frame's bytes and keeps their CRC.
struct Writer<'w> {
    wire: &'w mut WireBuffer,
    crc: Crc16,
}

impl Writer<'_> {
    fn put(&mut self, byte: u8) -> Result<(), TooLong> {
        self.crc.update(byte);
        self.wire.push(byte)
    }

    fn header(&mut self, kind: u8, label: Label) -> Result<(), TooLong> {
        let sequence = if label.sequence { SEQUENCE } else { 0 };
        let fresh = if label.fresh { FRESH } else { 0 };
        self.put(kind | sequence | fresh | label.signature.dock.index())?;
        self.put(label.signature.epoch)
    }

    fn body(&mut self, to: Address, payload: &[u8]) -> Result<(), TooLong> {
        self.put(to.byte())?;
        payload.iter().try_for_each(|byte| self.put(*byte))
    }

    fn finish(self) -> Result<(), TooLong> {
        for byte in self.crc.value().to_be_bytes() {
            self.wire.push(byte)?;
        }
        self.wire.finish();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::message::TaskCode;
    use std::vec::Vec;

    const SIGNATURE: Signature = Signature { dock: Dock::Back, epoch: 0x5A };
    const LABEL: Label = Label { signature: SIGNATURE, sequence: true, fresh: false };
    const TO: Address = Address::here(TaskCode::HORMONE);

    fn wire(frame: Frame) -> Vec<u8> {
        let mut wire = WireBuffer::new();
        frame.encode(&mut wire).unwrap();
        wire.bytes().to_vec()
    }

    /// The frame's bytes before COBS.
    fn bytes(frame: Frame) -> Vec<u8> {
        cobs::decode(&mut wire(frame)).unwrap().to_vec()
    }

    /// `covered` with its CRC.
    fn sealed(covered: &[u8]) -> Vec<u8> {
        let mut crc = Crc16::new();
        for byte in covered {
            crc.update(*byte);
        }
        [covered, &crc.value().to_be_bytes()].concat()
    }

    #[test]
    fn the_layout_is_as_drawn() {
        let data = bytes(Frame::Data { label: LABEL, to: TO, payload: &[7, 8] });
        assert_eq!(data, sealed(&[0b0110_0001, 0x5A, 0xE1, 7, 8]));
        assert_eq!(bytes(Frame::Ack(LABEL)), sealed(&[0b1010_0001, 0x5A]));
        let fresh = Label { sequence: false, fresh: true, ..LABEL };
        assert_eq!(bytes(Frame::Ack(fresh)), sealed(&[0b1001_0001, 0x5A]));
        let datagram = bytes(Frame::Datagram { signature: SIGNATURE, to: TO, payload: &[9] });
        assert_eq!(datagram, sealed(&[0b1100_0001, 0x5A, 0xE1, 9]));
    }

    #[test]
    fn a_hormone_takes_nine_bytes_on_the_wire_and_an_ack_six() {
        for payload in [[1, 2], [0, 0]] {
            assert_eq!(wire(Frame::Data { label: LABEL, to: TO, payload: &payload }).len(), 9);
        }
        assert_eq!(wire(Frame::Ack(LABEL)).len(), 6);
    }

    #[test]
    fn too_long_a_payload_is_refused() {
        let payload = [1; MAX_PAYLOAD + 1];
        let frame = Frame::Data { label: LABEL, to: TO, payload: &payload };
        assert_eq!(frame.encode(&mut WireBuffer::new()), Err(TooLong));
        let too_long = sealed(&[&[0b0110_0001, 0x5A, 0xE1], &payload[..]].concat());
        assert_eq!(Frame::from_bytes(&too_long), Err(FrameError::Length));
    }

    #[test]
    fn what_is_no_frame_is_refused_for_its_reason() {
        for (covered, error) in [
            (&[][..], FrameError::Length),
            (&[0x40], FrameError::Length),
            (&[0x40, 1], FrameError::Length),
            (&[0x80, 1, 0xE0], FrameError::Length),
            (&[0xC0, 1], FrameError::Length),
            (&[0x00, 1, 0xE0], FrameError::Control),
            (&[0x46, 1, 0xE0], FrameError::Control),
            (&[0x47, 1, 0xE0], FrameError::Control),
            (&[0x48, 1, 0xE0], FrameError::Control),
            (&[0xD0, 1, 0xE0], FrameError::Control),
            (&[0xE0, 1, 0xE0], FrameError::Control),
            (&[0x40, 1, 0xC0], FrameError::Address),
        ] {
            assert_eq!(Frame::from_bytes(&sealed(covered)), Err(error), "{covered:02X?}");
        }
        assert_eq!(Frame::decode(&mut [3, 1, 0]), Err(FrameError::Cobs));
        for short in [&[][..], &[0], &[0xFF]] {
            assert_eq!(Frame::from_bytes(short), Err(FrameError::Length));
        }
    }

    /// Fault (c): a mistyped polynomial leaves errors that are not found.
    #[test]
    fn every_single_and_double_bit_error_is_found() {
        let payload: [u8; MAX_PAYLOAD] = core::array::from_fn(|index| index as u8 * 17);
        for length in 0..=MAX_PAYLOAD {
            every_bit_error_is_found(Frame::Data { label: LABEL, to: TO, payload: &payload[..length] });
        }
        every_bit_error_is_found(Frame::Ack(LABEL));
    }

    fn every_bit_error_is_found(frame: Frame) {
        let mut bytes = bytes(frame);
        let flip = |bytes: &mut Vec<u8>, bit: usize| bytes[bit / 8] ^= 1 << (bit % 8);
        for first in 0..bytes.len() * 8 {
            flip(&mut bytes, first);
            assert_eq!(Frame::from_bytes(&bytes), Err(FrameError::Crc));
            for second in 0..first {
                flip(&mut bytes, second);
                assert_eq!(Frame::from_bytes(&bytes), Err(FrameError::Crc));
                flip(&mut bytes, second);
            }
            flip(&mut bytes, first);
        }
        assert_eq!(Frame::from_bytes(&bytes), Ok(frame));
    }
}
