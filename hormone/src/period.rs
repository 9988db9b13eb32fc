//! The Period that an order asks for.

use core::num::NonZeroU16;

use crate::gait::Gait;

/// The unit of a Period on the wire, in milliseconds.
const UNIT: u16 = 50;

/// The shortest and the longest Period that can be ordered, in units: 250 ms and 4 s.
const SHORTEST: u8 = 5;
const LONGEST: u8 = 80;

/// The code on the wire for the gait's own Period.
const GAITS_OWN: u8 = 0x7F;

/// A Period: so many units of 50 ms, or the gait's own.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Period(u8);

impl Period {
    /// The gait's own.
    pub const OWN: Period = Period(GAITS_OWN);

    /// The Period with code `byte`: 5 to 80 times 50 ms, or 127 for the gait's own; `None` for all others.
    pub const fn from_byte(byte: u8) -> Option<Period> {
        match byte {
            SHORTEST..=LONGEST | GAITS_OWN => Some(Period(byte)),
            _ => None,
        }
    }

    /// A Period of so many milliseconds; `None` if that is no multiple of 50, or less than 250 or more than
    /// 4000.
    pub const fn of_milliseconds(period: u16) -> Option<Period> {
        let units = period / UNIT;
        let is_one = period.is_multiple_of(UNIT) && units >= SHORTEST as u16 && units <= LONGEST as u16;
        if is_one { Some(Period(units as u8)) } else { None }
    }

    /// Its code.
    pub const fn to_byte(self) -> u8 {
        self.0
    }

    /// `gait` in this Period.
    pub fn of(self, gait: Gait) -> Gait {
        if self.0 == GAITS_OWN {
            return gait;
        }
        let Some(beats) = NonZeroU16::new(gait.beats.into()) else { return gait };
        let beat = NonZeroU16::new(u16::from(self.0) * UNIT / beats);
        Gait { beat: beat.unwrap_or(gait.beat), ..gait }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gait::GAITS;

    #[test]
    fn every_period_survives_its_byte_and_nothing_else_is_one() {
        let periods: Vec<u8> = (0..=255).filter_map(Period::from_byte).map(Period::to_byte).collect();
        assert_eq!(periods, (5..=80).chain([127]).collect::<Vec<u8>>());
        let periods: Vec<u16> = (0..u16::MAX).filter(|&ms| Period::of_milliseconds(ms).is_some()).collect();
        assert_eq!(periods, (250..=4000).step_by(50).collect::<Vec<u16>>());
    }

    #[test]
    fn every_gait_walks_in_it_but_for_what_its_beats_leave_of_it() {
        for gait in GAITS.iter() {
            assert_eq!(Period::OWN.of(gait).beat, gait.beat);
            for byte in 5..=80 {
                let period = Period::from_byte(byte).unwrap().of(gait).period();
                let asked = u16::from(byte) * 50;
                assert!(
                    asked - u16::from(gait.beats) < period && period <= asked,
                    "{asked} of {}",
                    gait.name
                );
            }
        }
    }
}
