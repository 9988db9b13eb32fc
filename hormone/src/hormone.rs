//! The hormone: a message without destination or ID, which acts through the rules of its receivers.
//!
//! ```text
//!   byte 0: name (7..4), data (3..0) | byte 1: rhythm | byte 2, in a ring only: lifetime
//! ```
//! In a tree a hormone ends at the leaves. In a ring it would go round for ever: there it has a lifetime.

use core::num::NonZeroU8;

pub use crate::data::Data;

/// The most bytes of a hormone's payload.
pub const LONGEST: usize = 3;

/// A hormone message.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Hormone {
    /// The gait it paces, by [name](crate::gait::Gait::name): 1 is the paper's CP.
    pub name: u8,
    /// What it carries.
    pub data: Data,
    /// Changes when the way from the leader to the receiver changes. Each module adds a number of its own that is
    /// random at power-up and grows when its type changes: whose rhythm is another than before, starts afresh.
    pub rhythm: u8,
    /// The modules that it may still reach; no limit without it.
    pub lifetime: Option<NonZeroU8>,
}

/// A hormone as the bytes of a message.
pub struct Payload {
    bytes: [u8; LONGEST],
    length: usize,
}

impl Payload {
    /// The bytes.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or(&self.bytes)
    }
}

impl Hormone {
    /// The hormone as a message payload.
    pub fn to_payload(self) -> Payload {
        let first = self.name << 4 | self.data as u8;
        match self.lifetime {
            None => Payload { bytes: [first, self.rhythm, 0], length: 2 },
            Some(lifetime) => Payload { bytes: [first, self.rhythm, lifetime.get()], length: 3 },
        }
    }

    /// The hormone in `payload`, or `None` if it has another length, no name, unknown data or a lifetime of 0.
    pub fn from_payload(payload: &[u8]) -> Option<Hormone> {
        let (first, rhythm, lifetime) = match *payload {
            [first, rhythm] => (first, rhythm, None),
            [first, rhythm, lifetime] => (first, rhythm, Some(NonZeroU8::new(lifetime)?)),
            _ => return None,
        };
        let name = first >> 4;
        if name == 0 {
            return None;
        }
        Some(Hormone { name, data: Data::from_byte(first & 0x0F)?, rhythm, lifetime })
    }

    /// The hormone for the next module, or `None` if its life ends here.
    pub fn aged(self) -> Option<Hormone> {
        match self.lifetime {
            None => Some(self),
            Some(lifetime) => {
                let left = NonZeroU8::new(lifetime.get() - 1)?;
                Some(Hormone { lifetime: Some(left), ..self })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HORMONE: Hormone = Hormone { name: 1, data: Data::B, rhythm: 0x5A, lifetime: None };

    #[test]
    fn a_payload_is_name_and_data_then_the_rhythm_then_the_lifetime() {
        assert_eq!(HORMONE.to_payload().bytes(), [0x11, 0x5A]);
        let limited = Hormone { lifetime: NonZeroU8::new(6), ..HORMONE };
        assert_eq!(limited.to_payload().bytes(), [0x11, 0x5A, 6]);
    }

    #[test]
    fn every_hormone_survives_its_payload_and_nothing_else_is_one() {
        for first in 0..=u8::MAX {
            let is_one = first >> 4 > 0 && first & 0x0F < 6;
            for second in [0, 1, 0x80, 0xFF] {
                for payload in [&[first, second][..], &[first, second, 1], &[first, second, 255]] {
                    let hormone = Hormone::from_payload(payload);
                    assert_eq!(hormone.is_some(), is_one, "{payload:?}");
                    assert!(hormone.is_none_or(|hormone| hormone.to_payload().bytes() == payload));
                }
                assert_eq!(Hormone::from_payload(&[first, second, 0]), None);
            }
        }
        assert_eq!(Hormone::from_payload(&[0x10]), None);
        assert_eq!(Hormone::from_payload(&[0x10, 0, 1, 0]), None);
    }

    #[test]
    fn a_life_ends() {
        assert_eq!(HORMONE.aged(), Some(HORMONE));
        let limited = Hormone { lifetime: NonZeroU8::new(2), ..HORMONE };
        let last = limited.aged().unwrap();
        assert_eq!(last.lifetime, NonZeroU8::new(1));
        assert_eq!(last.aged(), None);
    }
}
