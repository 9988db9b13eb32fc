//! From bytes to the pulses of a serial line: 8 data bits, no parity, 1 stop bit.
//!
//! A character begins low, with its start bit, and ends high, with its stop bit. So it is a row of pulses, each low for
//! some bits and then high for some.
//!
//! On the robot the [vector](super::vectors) does what [`PulseEncoder::next`] does, on the same state; this is what it is held
//! against, and what makes the first pulse.

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

/// A line on which a bit lasts `BIT` ticks.
#[repr(transparent)]
#[derive(Clone, Copy)]
pub struct PulseEncoder<const BIT: u16> {
    /// The bits that no pulse was made of yet, the next one at the bottom, the stop bit on top; 0 when all is sent. The first
    /// bit of a pulse, always a low one, is not among them.
    bits: u16,
}

/// The stop bit behind a byte.
#[doc(hidden)]
pub const STOP: u16 = 1 << 8;

impl<const BIT: u16> PulseEncoder<BIT> {
    /// Nothing to send.
    pub const fn new() -> Self {
        PulseEncoder { bits: 0 }
    }

    /// Begins with `byte`, whose start bit is the first of a pulse.
    pub const fn begin(&mut self, byte: u8) {
        self.bits = STOP | byte as u16;
    }

    /// The next pulse, if there is one. `next_byte` is asked when it ends a character.
    pub fn next(&mut self, next_byte: impl FnOnce() -> Option<u8>) -> Option<Pulse> {
        if self.bits == 0 {
            return None;
        }
        let mut low = BIT;
        while !self.take_bit() {
            low += BIT;
        }
        let mut length = low + BIT;
        while self.take_bit() {
            length += BIT;
        }
        // Behind the stop bit there are zeros, of which the first was taken: it stands for the start bit that follows.
        if self.bits == 0
            && let Some(byte) = next_byte()
        {
            self.begin(byte);
        }
        Some(Pulse { low, length, is_last: self.bits == 0 })
    }

    fn take_bit(&mut self) -> bool {
        let bit = self.bits & 1 != 0;
        self.bits >>= 1;
        bit
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
        let mut encoder = PulseEncoder::<BIT>::new();
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
