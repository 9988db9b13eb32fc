//! One frame, as it is before COBS and after.
//!
//! ```text
//!              +---------+-------+-------------------+-----------+
//!              | control | epoch | payload, 0..=16 B |  CRC-16   |
//!              +---------+-------+-------------------+-----------+
//!
//!   control     7  6 | 5  4  3 | 2  1  0
//!               turn |   task  |  dock
//!
//!   turn        0 datagram; 1 even, 2 odd, 3 first message
//!   task        0 to 6 the behaviour that a message is for; 7 ACK
//! ```
//!
//! - `dock` and `epoch` are the sender's [`Signature`]; the turn tells one message from the next ([`Label`]).
//! - An ACK repeats the turn, the dock and the epoch of the frame it acknowledges, and has no payload.
//!   It thus names one frame of one sender. See [`super::arq`].
//! - A frame can't name a neighbour's system tasks, nor any module behind it.
//! - The CRC covers all before it and goes most significant byte first.
//!
//! COBS adds one byte, delimiter included, or two to one frame in 40: a hormone of 2 payload bytes takes 7 or
//! 8 on the wire, an ACK 5 or 6. At 38400 baud a byte takes 260 us.

use super::cobs::{self, NotCobs, WireBuffer};
use super::crc::Crc16;
use super::signature::Signature;
use crate::dock::Dock;
use crate::message::{MAX_PAYLOAD, TaskCode};

/// The turn stands in bits 7..6 of the control byte; 0 is a datagram's.
const TURN: u8 = 6;
const DATAGRAM: u8 = 0;

/// The task stands in bits 5..3.
const TASK: u8 = 3;
const THREE_BITS: u8 = 7;
/// Stands in place of a task's code in an ACK.
const ACK: u8 = TaskCode::BEHAVIOURS;

const _: () = assert!(ACK == THREE_BITS, "the codes of behaviours fill three bits but one");

/// Tells a message from the one before and the one after.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
#[repr(u8)]
pub enum Turn {
    Even = 1,
    Odd = 2,
    /// From the sender's reset until its first message is acknowledged, so that a message after a reset is
    /// new even if the sender has an epoch that it had before.
    First = 3,
}

impl Turn {
    /// The turn of the next message, when this one was acknowledged.
    #[must_use]
    pub const fn next(self) -> Turn {
        match self {
            Turn::First | Turn::Even => Turn::Odd,
            Turn::Odd => Turn::Even,
        }
    }

    const fn from_bits(bits: u8) -> Option<Turn> {
        match bits {
            1 => Some(Turn::Even),
            2 => Some(Turn::Odd),
            3 => Some(Turn::First),
            _ => None,
        }
    }
}

/// A label tells one message of a sender from the next. Repetitions bear the same label.
///
/// The turn changes with each message that was acknowledged, the epoch with each that was not.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub struct Label {
    pub signature: Signature,
    pub turn: Turn,
}

/// What goes over the wire in one piece. `to` is a behaviour of the receiving module.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Frame<'a> {
    /// A message under ARQ.
    Data { label: Label, to: TaskCode, payload: &'a [u8] },
    /// Acknowledges the data frame that bears this label.
    Ack(Label),
    /// A message sent once and not acknowledged.
    Datagram { signature: Signature, to: TaskCode, payload: &'a [u8] },
}

/// Why bytes are no frame. All count as errors of the link.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum FrameError {
    Cobs,
    /// Too short or too long for its kind.
    Length,
    Crc,
    /// No such dock, or an ACK of a datagram.
    Control,
}

/// No frame can say this: the payload is above [`MAX_PAYLOAD`] bytes, or `to` is no behaviour.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Unsayable;

impl<'a> Frame<'a> {
    /// Puts the frame into `wire`, ready to transmit.
    ///
    /// # Errors
    /// [`Unsayable`]; what was in `wire` before is still there.
    pub fn encode(&self, wire: &mut WireBuffer) -> Result<(), Unsayable> {
        let (turn, task, signature, payload) = match *self {
            Frame::Data { label: Label { signature, turn }, to, payload } => {
                (turn as u8, to.behaviour().ok_or(Unsayable)?, signature, payload)
            }
            Frame::Ack(Label { signature, turn }) => (turn as u8, ACK, signature, &[][..]),
            Frame::Datagram { signature, to, payload } => {
                (DATAGRAM, to.behaviour().ok_or(Unsayable)?, signature, payload)
            }
        };
        if payload.len() > MAX_PAYLOAD {
            return Err(Unsayable);
        }
        let mut crc = Crc16::new();
        let mut slots = wire.frame().iter_mut();
        let header = [turn << TURN | task << TASK | signature.dock.index(), signature.epoch];
        for bytes in [&header[..], payload] {
            for (byte, slot) in bytes.iter().zip(&mut slots) {
                crc.update(*byte);
                *slot = *byte;
            }
        }
        for (byte, slot) in crc.bytes().into_iter().zip(&mut slots) {
            *slot = byte;
        }
        wire.stuff(header.len() + payload.len() + 2);
        Ok(())
    }

    /// Reads a frame from what came over the wire up to and including a delimiter, in place.
    pub fn decode(wire: &'a mut [u8]) -> Result<Frame<'a>, FrameError> {
        let mut crc = Crc16::new();
        let bytes = cobs::decode(wire, |byte| crc.update(byte)).map_err(|NotCobs| FrameError::Cobs)?;
        let [control, epoch, payload @ .., _, _] = bytes else { return Err(FrameError::Length) };
        if !crc.is_confirmed() {
            return Err(FrameError::Crc);
        }
        if payload.len() > MAX_PAYLOAD {
            return Err(FrameError::Length);
        }
        let dock = Dock::from_index(control & THREE_BITS).ok_or(FrameError::Control)?;
        let signature = Signature { dock, epoch: *epoch };
        let to = TaskCode::of_behaviour(control >> TASK & THREE_BITS);
        match (Turn::from_bits(control >> TURN), to) {
            (Some(turn), Some(to)) => Ok(Frame::Data { label: Label { signature, turn }, to, payload }),
            (None, Some(to)) => Ok(Frame::Datagram { signature, to, payload }),
            (Some(turn), None) if payload.is_empty() => Ok(Frame::Ack(Label { signature, turn })),
            (Some(_), None) => Err(FrameError::Length),
            (None, None) => Err(FrameError::Control),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    const SIGNATURE: Signature = Signature { dock: Dock::Back, epoch: 0x5A };
    const LABEL: Label = Label { signature: SIGNATURE, turn: Turn::Odd };
    const TO: TaskCode = TaskCode::HORMONE;

    fn wire(frame: Frame) -> Vec<u8> {
        let mut wire = WireBuffer::new();
        frame.encode(&mut wire).unwrap();
        wire.bytes().to_vec()
    }

    /// The frame's bytes before COBS.
    fn bytes(frame: Frame) -> Vec<u8> {
        cobs::decode(&mut wire(frame), |_| ()).unwrap().to_vec()
    }

    /// `covered` with its CRC.
    fn sealed(covered: &[u8]) -> Vec<u8> {
        let mut crc = Crc16::new();
        for byte in covered {
            crc.update(*byte);
        }
        [covered, &crc.bytes()].concat()
    }

    /// Reads these bytes as a frame, after bringing them into the form of the wire.
    fn read(bytes: &[u8]) -> Result<(), FrameError> {
        let mut wire = WireBuffer::new();
        wire.frame()[..bytes.len()].copy_from_slice(bytes);
        wire.stuff(bytes.len());
        Frame::decode(&mut wire.bytes().to_vec()).map(|_| ())
    }

    #[test]
    fn the_layout_is_as_drawn() {
        let data = bytes(Frame::Data { label: LABEL, to: TO, payload: &[7, 8] });
        assert_eq!(data, sealed(&[0b10_001_001, 0x5A, 7, 8]));
        assert_eq!(bytes(Frame::Ack(LABEL)), sealed(&[0b10_111_001, 0x5A]));
        let first = Label { turn: Turn::First, ..LABEL };
        assert_eq!(bytes(Frame::Ack(first)), sealed(&[0b11_111_001, 0x5A]));
        let datagram = bytes(Frame::Datagram { signature: SIGNATURE, to: TO, payload: &[9] });
        assert_eq!(datagram, sealed(&[0b00_001_001, 0x5A, 9]));
    }

    #[test]
    fn a_hormone_takes_seven_bytes_on_the_wire_and_an_ack_five_one_more_to_few() {
        let mut longer = [0, 0];
        for rhythm in 0..=255 {
            let payload = [0x10, rhythm];
            let signature = Signature { epoch: rhythm, ..SIGNATURE };
            let label = Label { signature, ..LABEL };
            let hormone = wire(Frame::Data { label: LABEL, to: TO, payload: &payload }).len();
            let ack = wire(Frame::Ack(label)).len();
            assert!((7..=8).contains(&hormone) && (5..=6).contains(&ack));
            longer[0] += hormone - 7;
            longer[1] += ack - 5;
        }
        assert!(longer.iter().all(|longer| *longer <= 256 / 30), "{longer:?}");
    }

    #[test]
    fn what_no_frame_can_say_is_refused() {
        let payload = [1; MAX_PAYLOAD + 1];
        let mut wire = WireBuffer::new();
        let frame = Frame::Data { label: LABEL, to: TO, payload: &payload };
        assert_eq!(frame.encode(&mut wire), Err(Unsayable));
        for code in 0..32 {
            let to = TaskCode::new(code).unwrap();
            let is_sayable = Frame::Data { label: LABEL, to, payload: &[] }.encode(&mut wire).is_ok();
            assert_eq!(is_sayable, to.is_behaviour());
            let datagram = Frame::Datagram { signature: SIGNATURE, to, payload: &[] };
            assert_eq!(datagram.encode(&mut wire).is_ok(), to.is_behaviour());
        }
    }

    #[test]
    fn what_is_no_frame_is_refused_for_its_reason() {
        let too_long = [&[0b10_001_001, 0x5A][..], &[1; MAX_PAYLOAD + 1]].concat();
        let too_long = sealed(&too_long);
        let (last, before) = too_long.split_last().unwrap();
        let mut reduced = [&[*last], before, &[0]].concat();
        assert_eq!(Frame::decode(&mut reduced), Err(FrameError::Length));
        for (covered, error) in [
            (&[][..], FrameError::Length),
            (&[0x40], FrameError::Length),
            (&[0b01_111_000, 1, 2], FrameError::Length),
            (&[0b01_000_110, 1], FrameError::Control),
            (&[0b01_000_111, 1], FrameError::Control),
            (&[0b00_111_000, 1], FrameError::Control),
        ] {
            assert_eq!(read(&sealed(covered)), Err(error), "{covered:02X?}");
        }
        assert_eq!(Frame::decode(&mut [3, 0, 1, 0]), Err(FrameError::Cobs));
        for short in [&[][..], &[0], &[0xFF]] {
            assert_eq!(read(short), Err(FrameError::Length));
        }
    }

    /// A neighbour can't name a system task, whatever it writes into a header.
    #[test]
    fn every_header_is_for_a_behaviour_or_no_frame() {
        let mut named = [0; 32];
        for header in 0..=u16::MAX {
            let mut wire = WireBuffer::new();
            let bytes = sealed(&[&header.to_be_bytes()[..], &[7]].concat());
            wire.frame()[..bytes.len()].copy_from_slice(&bytes);
            wire.stuff(bytes.len());
            if let Ok(Frame::Data { to, .. } | Frame::Datagram { to, .. }) =
                Frame::decode(&mut wire.bytes().to_vec())
            {
                assert!(to.is_behaviour());
                named[usize::from(to.code())] += 1;
            }
        }
        // Six docks, 256 epochs, four turns.
        assert_eq!(
            named.map(|count| count / (6 * 256 * 4)),
            core::array::from_fn(|code| u32::from(code < 7))
        );
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
            assert_eq!(read(&bytes), Err(FrameError::Crc));
            for second in 0..first {
                flip(&mut bytes, second);
                assert_eq!(read(&bytes), Err(FrameError::Crc));
                flip(&mut bytes, second);
            }
            flip(&mut bytes, first);
        }
        assert_eq!(read(&bytes), Ok(()));
    }
}
