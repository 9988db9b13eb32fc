//! CRC-16 of a frame, by arithmetic: a table would take 512 bytes of RAM.

/// CRC-16/GENIBUS: the CCITT's polynomial 0x1021, initial value 0xFFFF, most significant bit first,
/// inverted. Any three wrong bits in a frame are found, and any burst of up to 16.
///
/// The inversion matters. Without it a frame whose CRC ends in a zero byte stays valid when that byte
/// is cut off, and one wrong bit on the wire does just that: COBS writes such an end as 01 00.
#[derive(Clone, Copy)]
pub struct Crc16 {
    high: u8,
    low: u8,
}

impl Crc16 {
    pub const fn new() -> Crc16 {
        Crc16 { high: 0xFF, low: 0xFF }
    }

    /// Takes in one byte.
    ///
    /// The polynomial is x^16 + x^12 + x^5 + 1. In a division by whole bytes, the bits that leave at the top
    /// flip bits of the quotient itself four places on: that is the one shift by 4. The remainder then enters
    /// at x^12, x^5 and 1. Each byte is shifted by itself, because the AVR shifts no other way.
    pub const fn update(&mut self, byte: u8) {
        let mut quotient = self.high ^ byte;
        quotient ^= quotient >> 4;
        self.high = self.low ^ quotient << 4 ^ quotient >> 3;
        self.low = quotient << 5 ^ quotient;
    }

    /// The CRC of the bytes taken in, most significant byte first.
    pub const fn bytes(self) -> [u8; 2] {
        [!self.high, !self.low]
    }

    /// Whether the last two bytes taken in are the CRC of those before.
    pub const fn is_confirmed(self) -> bool {
        // Then only the remainder of the CRC's inversion is left.
        self.high == 0x1D && self.low == 0x0F
    }
}

impl Default for Crc16 {
    fn default() -> Crc16 {
        Crc16::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crc(bytes: &[u8]) -> u16 {
        let mut crc = Crc16::new();
        for byte in bytes {
            crc.update(*byte);
        }
        u16::from_be_bytes(crc.bytes())
    }

    /// The definition, bit by bit.
    fn long_division(bytes: &[u8]) -> u16 {
        let mut remainder = 0xFFFF_u16;
        for byte in bytes {
            remainder ^= u16::from(*byte) << 8;
            for _ in 0..8 {
                let carry = remainder & 0x8000 != 0;
                remainder <<= 1;
                if carry {
                    remainder ^= 0x1021;
                }
            }
        }
        !remainder
    }

    #[test]
    fn known_vectors() {
        assert_eq!(crc(b"123456789"), 0xD64E, "the catalogue's check value");
        assert_eq!(crc(b""), 0x0000);
        assert_eq!(crc(b"A"), !0xB915);
    }

    #[test]
    fn every_pair_of_bytes_agrees_with_long_division() {
        for first in 0..=255 {
            for second in 0..=255 {
                assert_eq!(crc(&[first, second]), long_division(&[first, second]));
            }
        }
    }

    #[test]
    fn a_crc_confirms_what_it_follows() {
        for first in 0..=255 {
            for second in 0..=255 {
                let mut crc = Crc16::new();
                [first, second].into_iter().for_each(|byte| crc.update(byte));
                let [high, low] = crc.bytes();
                for (last, is_right) in [(low, true), (low ^ 1, false), (low ^ 0x80, false)] {
                    let mut whole = crc;
                    [high, last].into_iter().for_each(|byte| whole.update(byte));
                    assert_eq!(whole.is_confirmed(), is_right);
                }
            }
        }
    }
}
