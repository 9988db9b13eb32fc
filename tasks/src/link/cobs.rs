//! Consistent Overhead Byte Stuffing (Cheshire and Baker, 1999): a frame without a zero byte, so
//! that a zero delimits it and a receiver finds the next frame after any noise.
//!
//! Each zero is replaced by the distance to the next one, and one more distance leads. The last distance
//! leads to the delimiter. In the reduced form (COBS/R, McQueen, 2010) the frame's last byte takes the place
//! of that distance if it is no smaller: a value that leads beyond the delimiter can't be a distance. The
//! last byte is almost always that large, so a frame grows by one byte, delimiter included; otherwise it
//! grows by two. Frames here are far shorter than COBS's longest run of 254.
//!
//! ```text
//!   frame      11 22 00 33          wire   03 11 22 33 00
//!   frame      11 22 00 01          wire   03 11 22 02 01 00
//! ```

use super::sizes::{MAX_FRAME, MAX_WIRE};

const DELIMITER: u8 = 0;

/// One frame as it goes over the wire. Every transmission of a message is the same bytes, so the
/// buffer is filled once and sent as often as the ARQ asks.
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct WireBuffer {
    bytes: [u8; MAX_WIRE],
    length: u8,
}

impl WireBuffer {
    pub const fn new() -> WireBuffer {
        WireBuffer { bytes: [0; MAX_WIRE], length: 0 }
    }

    /// The bytes to transmit, delimiter included; empty before the first frame.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or(&[])
    }

    /// Where a frame is written before it is [stuffed](Self::stuff).
    pub(super) fn frame(&mut self) -> &mut [u8; MAX_FRAME] {
        let [_, frame @ .., _] = &mut self.bytes;
        frame
    }

    /// Brings the frame of `length` bytes that was written into its form on the wire, backwards from the end.
    pub(super) fn stuff(&mut self, length: usize) {
        let [leading, rest @ ..] = &mut self.bytes;
        let Some((frame, [end, ..])) = rest.split_at_mut_checked(length) else { return };
        // May take the place of the last distance, which the loop meets first. If the last byte is zero, or
        // there is none, the distance is greater.
        let mut last = frame.last().copied().unwrap_or(0);
        *end = DELIMITER;
        let mut distance = 1;
        let mut is_reduced = false;
        for byte in frame.iter_mut().rev() {
            if *byte != 0 {
                distance += 1;
                continue;
            }
            is_reduced |= last >= distance;
            *byte = distance.max(last);
            (distance, last) = (1, 0);
        }
        is_reduced |= last >= distance;
        *leading = distance.max(last);
        if is_reduced && let Some(byte) = frame.last_mut() {
            *byte = DELIMITER;
        }
        self.length = length as u8 + if is_reduced { 1 } else { 2 };
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

/// Undoes COBS in place: `wire` is what came up to a delimiter and that delimiter. `each` sees every byte of
/// the frame in turn.
///
/// Every distance but the leading one stands where the frame has a zero. Once the zeros are put back, the
/// frame is all that follows the leading distance. In the reduced form its last byte is put in the
/// delimiter's place.
pub fn decode(wire: &mut [u8], mut each: impl FnMut(u8)) -> Result<&[u8], NotCobs> {
    let [leading, rest @ ..] = wire else { return Err(NotCobs) };
    let Some((end @ &mut DELIMITER, frame)) = rest.split_last_mut() else { return Err(NotCobs) };
    let mut last_distance = *leading;
    let mut distance = last_distance;
    for byte in frame.iter_mut() {
        if distance == 0 || *byte == DELIMITER {
            return Err(NotCobs);
        }
        distance -= 1;
        if distance == 0 {
            last_distance = core::mem::replace(byte, 0);
            distance = last_distance;
        }
        each(*byte);
    }
    match distance {
        0 => Err(NotCobs),
        1 => {
            // A frame has one form only.
            let is_plain = frame.last().is_none_or(|last| *last < last_distance);
            let length = frame.len();
            if is_plain { rest.get(..length).ok_or(NotCobs) } else { Err(NotCobs) }
        }
        _ => {
            *end = last_distance;
            each(last_distance);
            Ok(rest)
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    fn encode(frame: &[u8]) -> Vec<u8> {
        let mut wire = WireBuffer::new();
        wire.frame()[..frame.len()].copy_from_slice(frame);
        wire.stuff(frame.len());
        wire.bytes().to_vec()
    }

    /// The frame, and what was seen of it byte by byte.
    fn decode_seen(wire: &[u8]) -> Result<(Vec<u8>, Vec<u8>), NotCobs> {
        let (mut wire, mut seen) = (wire.to_vec(), Vec::new());
        let frame = decode(&mut wire, |byte| seen.push(byte))?.to_vec();
        Ok((frame, seen))
    }

    #[test]
    fn known_vectors() {
        for (frame, wire) in [
            (&[][..], &[1, 0][..]),
            (&[0], &[1, 1, 0]),
            (&[0, 0], &[1, 1, 1, 0]),
            (&[0x11, 0x22, 0, 0x33], &[3, 0x11, 0x22, 0x33, 0]),
            (&[0x11, 0x22, 0, 1], &[3, 0x11, 0x22, 2, 1, 0]),
            (&[0x11, 0x22, 0, 2], &[3, 0x11, 0x22, 2, 0]),
            (&[0x11, 0, 0, 0], &[2, 0x11, 1, 1, 1, 0]),
            (&[0x11, 0x22, 0x33], &[0x33, 0x11, 0x22, 0]),
            (&[0x11, 0x22, 3], &[4, 0x11, 0x22, 3, 0]),
            (&[0x11, 0x22, 4], &[4, 0x11, 0x22, 0]),
            (&[1], &[2, 1, 0]),
            (&[2], &[2, 0]),
        ] {
            assert_eq!(encode(frame), wire);
            assert_eq!(decode_seen(wire), Ok((frame.to_vec(), frame.to_vec())));
        }
    }

    #[test]
    fn every_pattern_of_zeros_returns_unchanged_for_two_bytes_more_at_most() {
        for length in 0..=MAX_FRAME {
            for zeros in (0..1u32 << length).step_by(if length > 12 { 37 } else { 1 }) {
                for last in [0, 1, length as u8, length as u8 + 1, 0xFF] {
                    let mut frame: Vec<u8> = (0..length)
                        .map(|place| if zeros >> place & 1 == 1 { 0 } else { place as u8 + 1 })
                        .collect();
                    if let Some(byte) = frame.last_mut() {
                        *byte = last;
                    }
                    let wire = encode(&frame);
                    let is_reduced = length > 0 && usize::from(last) > length;
                    assert!(wire.len() == length + 1 || !is_reduced && wire.len() == length + 2);
                    assert_eq!(wire.iter().position(|byte| *byte == 0), Some(wire.len() - 1));
                    assert_eq!(decode_seen(&wire), Ok((frame.clone(), frame)));
                }
            }
        }
    }

    #[test]
    fn what_is_not_cobs_is_refused() {
        for wire in [
            &[][..],
            &[0],
            &[1],
            &[0, 0],
            &[1, 1],
            &[0, 1, 0],
            &[2, 9, 0],
            &[3, 9, 3, 0],
            &[2, 0, 1, 0],
            &[3, 0, 9, 0],
            &[1, 2, 9, 0],
        ] {
            assert_eq!(decode_seen(wire), Err(NotCobs), "{wire:?}");
        }
    }

    /// Every sequence of up to 6 bytes between 0 and 6 either is refused or is what encoding gives.
    #[test]
    fn a_frame_has_one_form_only() {
        let mut accepted = 0;
        for length in 0..=6 {
            for number in 0..7_u32.pow(length) {
                let wire: Vec<u8> = (0..length).map(|place| (number / 7_u32.pow(place) % 7) as u8).collect();
                if let Ok((frame, _)) = decode_seen(&wire) {
                    assert_eq!(encode(&frame), wire);
                    accepted += 1;
                }
            }
        }
        // Frames of up to 4 bytes out of 0..=6, and those of 5 bytes that are reduced.
        let all = |length| (0..7_u32.pow(length)).map(move |number| (number, length));
        let frames = (0..=5).flat_map(all).map(|(number, length)| {
            (0..length).map(|place| (number / 7_u32.pow(place) % 7) as u8).collect::<Vec<u8>>()
        });
        assert_eq!(accepted, frames.filter(|frame| encode(frame).len() <= 6).count());
    }
}
