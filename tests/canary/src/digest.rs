//! The digest of a check's results.

use core::hash::Hasher;

/// FNV-1a in 32 bits. Unlike other hashers it is the same on every machine: `usize` counts as 16 bits.
pub struct Digest(u32);

impl Digest {
    pub fn new() -> Self {
        Digest(0x811c_9dc5)
    }
}

impl Hasher for Digest {
    #[inline(never)]
    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u32::from(*byte)).wrapping_mul(0x0100_0193);
        }
    }

    fn write_u16(&mut self, value: u16) {
        self.write(&value.to_le_bytes());
    }

    fn write_u32(&mut self, value: u32) {
        self.write(&value.to_le_bytes());
    }

    fn write_u64(&mut self, value: u64) {
        self.write(&value.to_le_bytes());
    }

    fn write_usize(&mut self, value: usize) {
        self.write_u16(value as u16);
    }

    fn write_isize(&mut self, value: isize) {
        self.write_u16(value as u16);
    }

    fn finish(&self) -> u64 {
        self.0.into()
    }
}
