//! The senses of a module, as conditions of rules: each is a sensor, and what it has to read.
//!
//! A sense has hysteresis: between the reading at which it begins to hold and the one at which it ends, it
//! stays as it is, so noise does not make a module change to and fro. HORMONE asks the sensor eight times a
//! beat while the module's type has a rule with the sense, and the mean counts for the next beats. One
//! reading would not do: a foot that lands jolts its leg by more than its weight. To add a sense, add its
//! line to the registry at the end of this file.

use core::num::NonZeroU16;

use tasks::sensor::Sensor;

/// The time from one reading to the next in a beat of this length, in milliseconds: eight readings fall
/// within the beat, and none is answered as the next beat comes.
pub fn between_readings(beat: NonZeroU16) -> u16 {
    beat.get().wrapping_mul(2) / 15
}

/// For so many beats a sense holds without another reading. Answers may be lost, but a sensor that has fallen
/// silent is not believed.
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

            /// The sensor whose readings decide.
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

/// The present state of a module's senses, each by its code.
#[derive(Clone, Copy)]
pub struct Senses {
    /// For how many more beats each holds; 0 if it does not.
    beats: [u8; Sense::ALL.len()],
    /// Whether each held as this beat began.
    has_held: [bool; Sense::ALL.len()],
    /// The sum of how far this beat's readings lie beyond the bound.
    beyond: [i16; Sense::ALL.len()],
}

impl Senses {
    /// Nothing was read: no sense holds.
    pub const NONE: Senses = Senses {
        beats: [0; Sense::ALL.len()],
        has_held: [false; Sense::ALL.len()],
        beyond: [0; Sense::ALL.len()],
    };

    /// The senses that hold.
    pub fn held(self) -> impl Iterator<Item = Sense> {
        Sense::ALL.into_iter().zip(self.beats).filter(|(_, beats)| *beats > 0).map(|(sense, _)| sense)
    }

    /// The sensor of `sense` reads `value`. The mean of its readings in this beat counts.
    pub fn read(&mut self, sense: Sense, value: i16) {
        let place = sense as usize;
        let [begins, ends] = sense.bounds();
        if let Some(beyond) = self.beyond.get_mut(place)
            && let Some(beats) = self.beats.get_mut(place)
            && let Some(&has_held) = self.has_held.get(place)
        {
            let bound = if has_held { ends } else { begins };
            *beyond = beyond.saturating_add(value.saturating_sub(bound));
            let holds = if begins < ends { *beyond < 0 } else { *beyond > 0 };
            *beats = if holds { LASTS } else { 0 };
        }
    }

    /// A beat begins.
    pub fn beat(&mut self) {
        self.has_held = self.beats.map(|beats| beats > 0);
        self.beats = self.beats.map(|beats| beats.saturating_sub(1));
        self.beyond = Senses::NONE.beyond;
    }
}

senses! {
    /// The half with the Front dock lies on its back: it is turned by more than 120 degrees, and the sense
    /// ends when it is turned by less than 104.5.
    UpsideDown = 0: Sensor::AccelerationZ, from -500 to -250,
}

#[cfg(test)]
mod tests {
    use super::*;
    use Sense::UpsideDown;

    /// A beat in which this was read.
    fn beat(senses: &mut Senses, values: &[i16]) {
        senses.beat();
        for &value in values {
            senses.read(UpsideDown, value);
        }
    }

    #[test]
    fn a_sense_begins_and_ends_at_its_bounds_whatever_is_read_between() {
        for value in i16::MIN..=i16::MAX {
            for was_held in [false, true] {
                let mut senses = Senses::NONE;
                beat(&mut senses, &[if was_held { -1000 } else { 1000 }]);
                assert_eq!(senses.held().eq([UpsideDown]), was_held);
                beat(&mut senses, &[value]);
                let holds = if was_held { value < -250 } else { value < -500 };
                assert_eq!(senses.held().eq([UpsideDown]), holds, "{value} after {was_held}");
            }
        }
    }

    #[test]
    fn it_is_the_mean_of_a_beat_that_counts_however_many_readings_there_are() {
        for count in 1..=100 {
            for (mean, holds) in [(-501, true), (-499, false)] {
                let mut senses = Senses::NONE;
                // One by one below and above the mean, but for the last of an odd number.
                let values: Vec<i16> = (0..count)
                    .map(|place| match place {
                        _ if place + 1 == count && count % 2 == 1 => mean,
                        _ if place % 2 == 0 => mean - 1500,
                        _ => mean + 1500,
                    })
                    .collect();
                beat(&mut senses, &values);
                assert_eq!(senses.held().eq([UpsideDown]), holds, "{values:?}");
            }
        }
    }

    #[test]
    fn a_jolt_within_a_beat_counts_for_nothing() {
        for (usual, jolt) in [(1000, -2500), (-1000, 2500)] {
            let mut senses = Senses::NONE;
            beat(&mut senses, &[usual; 8]);
            for at in 0..8 {
                let mut values = [usual; 8];
                values[at] = jolt;
                beat(&mut senses, &values);
                assert_eq!(senses.held().eq([UpsideDown]), usual < 0);
            }
        }
    }

    #[test]
    fn readings_that_no_sensor_gives_do_not_turn_the_mean_round() {
        for (value, holds) in [(i16::MIN, true), (i16::MAX, false)] {
            let mut senses = Senses::NONE;
            beat(&mut senses, &[value; 1000]);
            assert_eq!(senses.held().eq([UpsideDown]), holds);
        }
    }

    #[test]
    fn what_is_not_read_again_is_forgotten() {
        let mut senses = Senses::NONE;
        beat(&mut senses, &[-1000]);
        for _ in 0..LASTS {
            assert!(senses.held().eq([UpsideDown]));
            senses.beat();
        }
        assert!(senses.held().eq([]));
        senses.beat();
        assert!(senses.held().eq([]));
    }

    #[test]
    fn eight_readings_are_answered_before_the_next_beat_and_none_as_it_comes() {
        const ANSWERED_AFTER: u16 = 5;
        for beat in 125..=4_000 {
            let between = between_readings(NonZeroU16::new(beat).expect("it takes time"));
            assert!(7 * between + ANSWERED_AFTER < beat, "at a beat of {beat} ms");
            assert!(8 * between > beat, "at a beat of {beat} ms");
        }
    }

    #[test]
    fn codes_are_places() {
        assert!(Sense::ALL.iter().enumerate().all(|(place, &sense)| sense as usize == place));
    }
}
