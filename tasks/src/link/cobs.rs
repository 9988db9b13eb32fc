//! Consistent Overhead Byte Stuffing (Cheshire and Baker, 1999): a frame without a zero byte, so
//! that a zero delimits it and a receiver finds the next frame after any noise.
//!
//! Each zero is replaced by the distance to the next one, and one more distance leads. Frames here
//! are far shorter than COBS's longest run of 254, so the cost is always that one byte and the
//! delimiter.
//!
//! ```text
//!   frame      11 22 00 33          wire   03 11 22 02 33 00
//! ```

use super::frame::MAX_FRAME;
use crate::message::TooLong;

/// The most bytes that a frame takes on the wire, delimiter included.
pub const MAX_WIRE: usize = 1 + MAX_FRAME + 1;

const DELIMITER: u8 = 0;

/// One frame as it goes over the wire. Every transmission of a message is the same bytes, so the
/// buffer is filled once and sent as often as the ARQ asks.
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct WireBuffer {
    bytes: [u8; MAX_WIRE],
    length: u8,
    /// Where the distance of the run being written will stand.
    run_start: u8,
}

impl WireBuffer {
    pub const fn new() -> WireBuffer {
        WireBuffer { bytes: [0; MAX_WIRE], length: 0, run_start: 0 }
    }

    /// What to transmit, delimiter included; empty before the first frame.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or(&[])
    }

    /// Starts a frame in place of the one before.
    pub(super) fn begin(&mut self) {
        self.run_start = 0;
        self.length = 1;
    }

    /// Appends one byte of the frame; an error beyond [`MAX_FRAME`] of them.
    pub(super) fn push(&mut self, byte: u8) -> Result<(), TooLong> {
        // The last place is the delimiter's.
        if usize::from(self.length) >= MAX_WIRE - 1 {
            return Err(TooLong);
        }
        if byte == 0 {
            self.close_run();
            self.run_start = self.length;
        } else {
            self.put(self.length, byte);
        }
        self.length += 1;
        Ok(())
    }

    /// Ends the frame with the delimiter.
    pub(super) fn finish(&mut self) {
        self.close_run();
        self.put(self.length, DELIMITER);
        self.length += 1;
    }

    fn close_run(&mut self) {
        self.put(self.run_start, self.length.wrapping_sub(self.run_start));
    }

    fn put(&mut self, place: u8, byte: u8) {
        if let Some(slot) = self.bytes.get_mut(usize::from(place)) {
            *slot = byte;
        }
    }
}

impl Default for WireBuffer {
    fn default() -> WireBuffer {
        WireBuffer::new()
    }
}

/// The bytes are not the COBS form of any frame.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct NotCobs;

/// Undoes COBS in place: `wire` is what came up to a delimiter and that delimiter.
///
/// Every distance but the leading one stands where the frame has a zero, so the frame is all between
/// the ends once those are put back.
pub fn decode(wire: &mut [u8]) -> Result<&[u8], NotCobs> {
    let [leading, frame @ .., DELIMITER] = wire else {
        return Err(NotCobs);
    };
    let mut distance = *leading;
    for byte in frame.iter_mut() {
        if distance == 0 || *byte == DELIMITER {
            return Err(NotCobs);
        }
        distance -= 1;
        if distance == 0 {
            distance = core::mem::replace(byte, 0);
        }
    }
    // The last distance leads to the delimiter.
    if distance == 1 { Ok(frame) } else { Err(NotCobs) }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    fn encode(frame: &[u8]) -> Result<Vec<u8>, TooLong> {
        let mut wire = WireBuffer::new();
        wire.begin();
        for byte in frame {
            wire.push(*byte)?;
        }
        wire.finish();
        Ok(wire.bytes().to_vec())
    }

    #[test]
    fn known_vectors() {
        for (frame, wire) in [
            (&[][..], &[1, 0][..]),
            (&[0], &[1, 1, 0]),
            (&[0, 0], &[1, 1, 1, 0]),
            (&[0x11, 0x22, 0, 0x33], &[3, 0x11, 0x22, 2, 0x33, 0]),
            (&[0x11, 0, 0, 0], &[2, 0x11, 1, 1, 1, 0]),
        ] {
            assert_eq!(encode(frame).unwrap(), wire);
            assert_eq!(decode(&mut wire.to_vec()), Ok(frame));
        }
    }

    #[test]
    fn every_pattern_of_zeros_returns_unchanged_for_two_bytes_more() {
        for length in 0..=MAX_FRAME {
            for zeros in (0..1u32 << length).step_by(if length > 12 { 37 } else { 1 }) {
                let frame: Vec<u8> = (0..length)
                    .map(|place| if zeros >> place & 1 == 1 { 0 } else { place as u8 + 1 })
                    .collect();
                let mut wire = encode(&frame).unwrap();
                assert_eq!(wire.len(), length + 2);
                assert_eq!(wire.iter().position(|byte| *byte == 0), Some(wire.len() - 1));
                assert_eq!(decode(&mut wire), Ok(&frame[..]));
            }
        }
    }

    #[test]
    fn too_long_a_frame_is_refused() {
        assert!(encode(&[7; MAX_FRAME]).is_ok());
        assert_eq!(encode(&[7; MAX_FRAME + 1]), Err(TooLong));
        assert_eq!(encode(&[0; MAX_FRAME + 1]), Err(TooLong));
    }

    #[test]
    fn what_is_not_cobs_is_refused() {
        for wire in [
            &[][..],
            &[0],
            &[1],
            &[0, 0],
            &[2, 0],
            &[1, 1],
            &[0, 1, 0],
            &[3, 9, 0],
            &[2, 0, 1, 0],
            &[3, 0, 9, 0],
            &[1, 3, 9, 0],
            &[0xFF, 9, 9, 0],
        ] {
            assert_eq!(decode(&mut wire.to_vec()), Err(NotCobs), "{wire:?}");
        }
    }

    /// Every sequence of up to 6 bytes between 0 and 6 either is refused or is what encoding gives.
    #[test]
    fn a_frame_has_one_form_only() {
        let mut accepted = 0;
        for length in 0..=6 {
            for number in 0..7_u32.pow(length) {
                let wire: Vec<u8> = (0..length).map(|place| (number / 7_u32.pow(place) % 7) as u8).collect();
                if let Ok(frame) = decode(&mut wire.clone()) {
                    assert_eq!(encode(frame).unwrap(), wire);
                    accepted += 1;
                }
            }
        }
        // Frames of 0..=4 bytes out of 0..=6.
        assert_eq!(accepted, (0..=4).map(|length| 7_u32.pow(length)).sum::<u32>());
    }
}
