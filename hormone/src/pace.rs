//! The hormone of a gait: the paper's `[CP, A]`, and the like of it for the other gaits.
//!
//! ```text
//!   byte 0: name (7..4), made good (3), data (2..0) | byte 1: number (7..5), rhythm (4..0)
//!   bytes 2 and 3, in a ring only: lifetime
//! ```
//! In a tree a hormone ends at the leaves. In a ring it would go round for ever: there it has a lifetime, of
//! one byte where that suffices.

use core::num::NonZeroU16;

use crate::data::Data;

/// How many numbers of beats there are, and of rhythms.
pub const NUMBERS: u8 = 8;
pub const RHYTHMS: u8 = 32;

/// A beat on its way.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Pace {
    /// The [name](crate::gait::Gait::name) of the gait: 1 is the paper's CP.
    pub name: u8,
    /// The letter that it carries.
    pub data: Data,
    /// The leader's hormone for this beat was lost on the way, and a timer took its place.
    pub is_made_good: bool,
    /// The number of the leader's beat, modulo [`NUMBERS`]. It tells a hormone of the next beat from a late
    /// one of this beat, whatever their data.
    pub number: u8,
    /// Modulo [`RHYTHMS`]. Changes when the way from the leader to the receiver changes. Each module adds a
    /// summand of its own that is random at power-up and grows when its type changes. A receiver whose rhythm
    /// differs from the one before starts afresh.
    pub rhythm: u8,
    /// The modules that it may still reach; no limit without it.
    pub lifetime: Option<NonZeroU16>,
}

impl Pace {
    /// How many beats it is ahead of the one with this number, modulo [`NUMBERS`].
    pub const fn ahead_of(self, number: u8) -> u8 {
        self.number.wrapping_sub(number) % NUMBERS
    }

    /// The pace that goes on from a module that received this one, or `None` if its life ends there.
    pub fn aged(self) -> Option<Pace> {
        match self.lifetime {
            None => Some(self),
            Some(lifetime) => {
                let left = NonZeroU16::new(lifetime.get() - 1)?;
                Some(Pace { lifetime: Some(left), ..self })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_life_ends() {
        let pace =
            Pace { name: 1, data: Data::B, is_made_good: false, number: 0, rhythm: 0x5A, lifetime: None };
        assert_eq!(pace.aged(), Some(pace));
        let limited = Pace { lifetime: NonZeroU16::new(2), ..pace };
        let last = limited.aged().unwrap();
        assert_eq!(last.lifetime, NonZeroU16::new(1));
        assert_eq!(last.aged(), None);
    }
}
