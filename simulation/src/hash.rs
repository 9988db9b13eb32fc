//! Hashes that are the same on every machine and in every run: FNV-1a, 64 bits.

use std::hash::Hasher;

/// The hash of bytes.
pub fn fnv_1a(bytes: impl IntoIterator<Item = u8>) -> u64 {
    bytes.into_iter().fold(Fnv::default().0, step)
}

/// The same for what can be hashed.
pub(crate) struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Self {
        Fnv(0xcbf2_9ce4_8422_2325)
    }
}

impl Hasher for Fnv {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        self.0 = bytes.iter().copied().fold(self.0, step);
    }
}

fn step(hash: u64, byte: u8) -> u64 {
    (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The hashes that the authors of FNV publish, in however many parts the bytes come.
    #[test]
    fn hashes_are_those_of_fnv_1a() {
        for (text, hash) in
            [("", 0xcbf2_9ce4_8422_2325), ("a", 0xaf63_dc4c_8601_ec8c), ("foobar", 0x8594_4171_f739_67e8)]
        {
            assert_eq!(fnv_1a(text.bytes()), hash, "{text}");
            for middle in 0..=text.len() {
                let mut hasher = Fnv::default();
                let (one, other) = text.as_bytes().split_at(middle);
                hasher.write(one);
                hasher.write(other);
                assert_eq!(hasher.finish(), hash, "{text} in two parts, from {middle}");
            }
        }
    }
}
