//! What a module senses of itself, as a condition of rules: a sensor, and what it has to read.
//!
//! Between the reading at which a sense begins to hold and the one at which it ends, it stays as it is: so
//! noise does not have a module do now this, now that. HORMONE asks the sensor once a beat, while its type
//! has a rule with the sense, and what it was told goes for the next beats. To add a sense, add its line to
//! the registry at the end of this file.

use tasks::sensor::Sensor;

/// For so many beats a sense holds without another reading: an answer may be lost, a sensor that fell silent
/// is not believed.
pub const LASTS: u8 = 4;

/// Declares [`Sense`]: a code, a sensor, and the readings, in the sensor's unit, beyond which the sense
/// begins to hold and short of which it ends. It holds below them if it begins below the reading at which it
/// ends, else above.
macro_rules! senses {
    ($($(#[$attribute:meta])* $name:ident = $code:literal: $sensor:expr, from $begins:literal to $ends:literal,)*) => {
        /// Something that a module senses.
        #[derive(Clone, Copy, PartialEq, Eq)]
        #[cfg_attr(not(target_arch = "avr"), derive(Debug))]
        #[repr(u8)]
        pub enum Sense {
            $($(#[$attribute])* $name = $code,)*
        }

        impl Sense {
            /// All of them, by their codes.
            pub const ALL: [Sense; [$($code),*].len()] = [$(Sense::$name),*];

            /// Whose readings tell.
            pub const fn sensor(self) -> Sensor {
                match self {
                    $(Sense::$name => $sensor,)*
                }
            }

            /// The readings at which it begins to hold, and ends.
            pub const fn bounds(self) -> [i16; 2] {
                match self {
                    $(Sense::$name => [$begins, $ends],)*
                }
            }
        }
    };
}

/// What a module senses now.
#[derive(Clone, Copy)]
pub struct Senses {
    /// By code, for how many beats each sense holds yet; 0 for one that does not.
    beats: [u8; Sense::ALL.len()],
}

impl Senses {
    /// Nothing was read: no sense holds.
    pub const NONE: Senses = Senses { beats: [0; Sense::ALL.len()] };

    /// The senses that hold.
    pub fn held(self) -> impl Iterator<Item = Sense> {
        Sense::ALL.into_iter().zip(self.beats).filter(|(_, beats)| *beats > 0).map(|(sense, _)| sense)
    }

    /// The sensor of `sense` reads `value`.
    pub fn read(&mut self, sense: Sense, value: i16) {
        let Some(beats) = self.beats.get_mut(sense as usize) else { return };
        let [begins, ends] = sense.bounds();
        let bound = if *beats > 0 { ends } else { begins };
        let holds = if begins < ends { value < bound } else { value > bound };
        *beats = if holds { LASTS } else { 0 };
    }

    /// A beat has passed.
    pub fn age(&mut self) {
        for beats in &mut self.beats {
            *beats = beats.saturating_sub(1);
        }
    }
}

senses! {
    /// The half with the Front dock lies on its back, turned by more than 120 degrees; until by less than
    /// 104.5.
    UpsideDown = 0: Sensor::AccelerationZ, from -500 to -250,
}

#[cfg(test)]
mod tests {
    use super::*;
    use Sense::UpsideDown;

    #[test]
    fn a_sense_begins_and_ends_at_its_bounds_whatever_is_read_between() {
        for value in i16::MIN..=i16::MAX {
            for was_held in [false, true] {
                let mut senses = Senses::NONE;
                senses.read(UpsideDown, if was_held { -1000 } else { 1000 });
                assert_eq!(senses.held().eq([UpsideDown]), was_held);
                senses.read(UpsideDown, value);
                let holds = if was_held { value < -250 } else { value < -500 };
                assert_eq!(senses.held().eq([UpsideDown]), holds, "{value} after {was_held}");
            }
        }
    }

    #[test]
    fn what_is_not_read_again_is_forgotten() {
        let mut senses = Senses::NONE;
        senses.read(UpsideDown, -1000);
        for _ in 0..LASTS {
            assert!(senses.held().eq([UpsideDown]));
            senses.age();
        }
        assert!(senses.held().eq([]));
        senses.age();
        assert!(senses.held().eq([]));
    }

    #[test]
    fn codes_are_places() {
        assert!(Sense::ALL.iter().enumerate().all(|(place, &sense)| sense as usize == place));
    }
}
