//! From bytes to the pulses of a serial line: 8 data bits, no parity, 1 stop bit.
//!
//! A character begins low, with its start bit, and ends high, with its stop bit. So it is a series of pulses,
//! each low for some bits and then high for some.
//!
//! The tests on the host and the vectors run the same code.

use core::cell::Cell;

/// A pulse, in ticks.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Pulse {
    /// How long the line is low.
    pub low: u16,
    /// How long it is low and then high.
    pub length: u16,
    /// Whether nothing follows: the line stays high.
    pub is_last: bool,
}

/// No bits are left. Not 0, for which the compiler keeps a register that a vector would have to save.
const ALL_SENT: u8 = 0xff;

/// A line on which a bit lasts `BIT` ticks.
pub struct PulseEncoder<const BIT: u16> {
    /// The bits that are not part of a pulse yet, the next one lowest, and ones above: the stop bit is one.
    /// The first bit of a pulse, always a low one, is not among them.
    bits: Cell<u8>,
    /// The number of these bits, the stop bit among them; or [`ALL_SENT`].
    left: Cell<u8>,
}

impl<const BIT: u16> PulseEncoder<BIT> {
    /// Nothing to send.
    pub const fn new() -> Self {
        PulseEncoder { bits: Cell::new(0), left: Cell::new(ALL_SENT) }
    }

    /// Begins with `byte`; its start bit is the first of a pulse.
    #[inline(always)]
    pub fn begin(&self, byte: u8) {
        self.bits.set(byte);
        self.left.set(9);
    }

    /// Continues where `other` is.
    #[inline(always)]
    pub fn go_on_from(&self, other: &Self) {
        self.bits.set(other.bits.get());
        self.left.set(other.left.get());
    }

    /// The next pulse, if there is one. `next_byte` is called when the pulse ends a character.
    #[inline(always)]
    pub fn next(&self, next_byte: impl FnOnce() -> Option<u8>) -> Option<Pulse> {
        let (mut bits, mut left) = (self.bits.get(), self.left.get());
        if left == ALL_SENT {
            return None;
        }
        let mut low = BIT;
        while bits & 1 == 0 {
            low += BIT;
            bits = bits >> 1 | 0x80;
            left -= 1;
        }
        let mut length = low;
        loop {
            length += BIT;
            bits = bits >> 1 | 0x80;
            left -= 1;
            if left == 0 || bits & 1 == 0 {
                break;
            }
        }
        if left != 0 {
            // The bit that follows is low, and the first of a pulse.
            self.bits.set(bits >> 1 | 0x80);
            self.left.set(left - 1);
        } else if let Some(byte) = next_byte() {
            self.begin(byte);
        } else {
            self.left.set(ALL_SENT);
            return Some(Pulse { low, length, is_last: true });
        }
        Some(Pulse { low, length, is_last: false })
    }
}

impl<const BIT: u16> Default for PulseEncoder<BIT> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use std::vec::Vec;

    const BIT: u16 = 100;

    /// The level in each bit, from the first start bit to the last stop bit.
    fn levels(bytes: &[u8]) -> Vec<bool> {
        let (mut rest, mut levels) = (bytes.iter().copied(), Vec::new());
        let encoder = PulseEncoder::<BIT>::new();
        encoder.begin(rest.next().expect("there is a first byte"));
        let mut is_over = false;
        while let Some(Pulse { low, length, is_last }) = encoder.next(|| rest.next()) {
            assert!(!is_over, "a pulse follows the last one");
            is_over = is_last;
            assert!(low % BIT == 0 && length % BIT == 0 && length > low && low > 0);
            levels.extend((0..length / BIT).map(|bit| bit >= low / BIT));
        }
        assert!(is_over, "the last one is said to be");
        levels
    }

    #[test]
    fn every_pair_of_bytes_is_sent_bit_by_bit() {
        for first in 0..=255u8 {
            for second in 0..=255u8 {
                let bits = [first, second].into_iter().flat_map(|byte| {
                    let data = (0..8).map(move |bit| byte >> bit & 1 != 0);
                    [false].into_iter().chain(data).chain([true])
                });
                assert_eq!(levels(&[first, second]), bits.collect::<Vec<_>>());
            }
        }
    }
}
