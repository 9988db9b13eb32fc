//! The data of a hormone: a letter, as in Table 1, one for each beat of a gait's Period.

/// A hormone's data field.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, PartialOrd, Ord))]
#[repr(u8)]
pub enum Data {
    /// Sent by the leader at the start of a Period.
    A = 0,
    /// Sent one beat later: at half a Period where there are two.
    B = 1,
    C = 2,
    D = 3,
    E = 4,
    F = 5,
}

/// The most beats that a Period can have.
pub const MOST_BEATS: u8 = 6;

impl Data {
    /// The value with code `byte`.
    pub const fn from_byte(byte: u8) -> Option<Data> {
        match byte {
            0 => Some(Data::A),
            1 => Some(Data::B),
            2 => Some(Data::C),
            3 => Some(Data::D),
            4 => Some(Data::E),
            5 => Some(Data::F),
            _ => None,
        }
    }

    /// The letter `count` beats later in a Period of `beats`; all three below 64.
    pub const fn later(self, count: u8, beats: u8) -> Data {
        let mut letter = self as u8 + count;
        while letter >= beats && beats > 0 {
            letter -= beats;
        }
        match Data::from_byte(letter) {
            Some(data) => data,
            None => Data::A,
        }
    }

    /// How many beats this letter comes after `other` in a Period of `beats`.
    pub const fn since(self, other: Data, beats: u8) -> u8 {
        let (to, from) = (self as u8, other as u8);
        if to >= from { to - from } else { (to + beats).saturating_sub(from) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_letter_survives_its_byte() {
        for byte in 0..=u8::MAX {
            assert_eq!(Data::from_byte(byte).map(|data| data as u8), (byte < MOST_BEATS).then_some(byte));
        }
    }

    #[test]
    fn letters_go_round() {
        for beats in 1..=MOST_BEATS {
            for letter in (0..beats).filter_map(Data::from_byte) {
                for count in 0..beats {
                    let later = letter.later(count, beats);
                    assert_eq!(later as u8, (letter as u8 + count) % beats);
                    assert_eq!(later.since(letter, beats), count);
                }
            }
        }
    }
}
