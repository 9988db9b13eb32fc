//! The numbers that checks compute with.

use core::hint::black_box;

/// A sequence of numbers, the same for each check, and unknown to the compiler.
pub struct Random(u16);

impl Random {
    pub fn new() -> Self {
        Random(black_box(0xace1))
    }

    /// Half of all bytes are 0x00, 0x01, 0x7f, 0x80 or 0xff: code goes wrong at carries, signs and limits.
    #[inline(never)]
    pub fn byte(&mut self) -> u8 {
        // Xorshift with a period of 65535 (Marsaglia, "Xorshift RNGs").
        self.0 ^= self.0 << 7;
        self.0 ^= self.0 >> 9;
        self.0 ^= self.0 << 8;
        let [low, high] = self.0.to_le_bytes();
        match high & 0x0f {
            0 | 1 => 0x00,
            2 => 0x01,
            3 => 0x7f,
            4 => 0x80,
            5..=7 => 0xff,
            _ => low,
        }
    }

    pub fn bytes<const N: usize>(&mut self) -> [u8; N] {
        core::array::from_fn(|_| self.byte())
    }

    pub fn word(&mut self) -> u16 {
        u16::from_le_bytes(self.bytes())
    }
}
