//! Varies by chance what the simulation assumes of modules.

use std::fmt;
use std::str::FromStr;

use plants::joint::POTENTIOMETER_TRAVEL;
use simulation::Random;
use thiserror::Error;
use world::Make;

/// A property of the modules that is not published, and so is assumed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Assumption {
    /// The mass of a module.
    Mass,
    /// Its friction on the ground.
    Friction,
    /// The stall torque of its motors.
    Torque,
    /// Their stall current.
    Current,
    /// The dry friction of their gears.
    GearFriction,
    /// The inertia of their rotors and gears.
    GearInertia,
    /// The angles at which the potentiometers of its joints sit on their shafts, in percent of their travel.
    Potentiometer,
    /// The readings of its converters, each for itself, in percent of full scale.
    Converter,
    /// The backlash of its gears, in percent of the potentiometers' travel.
    Backlash,
    /// How often the hooks of its latches miss a dock that they reach, in percent.
    Hooks,
}

impl Assumption {
    pub const ALL: [Self; 10] = [
        Self::Mass,
        Self::Friction,
        Self::Torque,
        Self::Current,
        Self::GearFriction,
        Self::GearInertia,
        Self::Potentiometer,
        Self::Converter,
        Self::Backlash,
        Self::Hooks,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::Mass => "mass",
            Self::Friction => "friction",
            Self::Torque => "torque",
            Self::Current => "current",
            Self::GearFriction => "gear-friction",
            Self::GearInertia => "gear-inertia",
            Self::Potentiometer => "potentiometer",
            Self::Converter => "converter",
            Self::Backlash => "backlash",
            Self::Hooks => "hooks",
        }
    }

    /// Varies the assumption in `make` by chance, by the fraction `part` of its value at most.
    fn vary(self, make: &mut Make, part: f64, random: &mut Random) {
        let mut drawn = || part * random.between(-1.0, 1.0);
        match self {
            Self::Mass => make.mass *= 1.0 + drawn(),
            Self::Friction => make.grip *= 1.0 + drawn(),
            Self::Torque => make.motor.stall_torque *= 1.0 + drawn(),
            Self::Current => make.motor.stall_current *= 1.0 + drawn(),
            Self::GearFriction => make.motor.sliding_friction *= 1.0 + drawn(),
            Self::GearInertia => make.motor.gear_inertia *= 1.0 + drawn(),
            Self::Potentiometer => make.zeros = [(); 3].map(|()| drawn() * POTENTIOMETER_TRAVEL),
            Self::Converter => (make.noise, make.noise_seed) = (part, random.next_u64()),
            Self::Backlash => make.backlash = part * POTENTIOMETER_TRAVEL,
            Self::Hooks => (make.misses, make.hooks_seed) = (part, random.next_u64()),
        }
    }
}

/// How far an assumption may vary, up or down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variation {
    pub of: Assumption,
    /// In percent, 0 to 90.
    pub percent: f64,
}

/// Why a text is not a variation.
#[derive(Debug, Error, PartialEq)]
pub enum VariationError {
    #[error("give an assumption and how much it varies at most, as in mass=20%")]
    Form,
    #[error(
        "there is no such assumption: give one of mass, friction, torque, current, \
         gear-friction, gear-inertia, potentiometer, converter, backlash, hooks"
    )]
    Name,
    #[error("give a variation from 0% to 90%")]
    Range,
}

impl FromStr for Variation {
    type Err = VariationError;

    /// Parses a text such as `mass=20%`.
    fn from_str(text: &str) -> Result<Self, VariationError> {
        let (name, percent) = text.split_once('=').ok_or(VariationError::Form)?;
        let percent = percent.strip_suffix('%').ok_or(VariationError::Form)?;
        let percent: f64 = percent.parse().map_err(|_| VariationError::Form)?;
        let of =
            Assumption::ALL.into_iter().find(|known| known.name() == name).ok_or(VariationError::Name)?;
        if (0.0..=90.0).contains(&percent) {
            // -0 becomes 0: otherwise the two would be different runs of a campaign.
            Ok(Variation { of, percent: percent.abs() })
        } else {
            Err(VariationError::Range)
        }
    }
}

impl fmt::Display for Variation {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} {} %", self.of.name(), self.percent)
    }
}

/// Varies each module on its own: uniformly between the limits, drawn from `seed`. The value of one
/// assumption does not depend on whether others are varied.
pub(crate) fn vary(makes: &mut [Make], variations: &[Variation], seed: u64) {
    // A sequence of its own, separate from the others that are drawn for modules.
    let seed = Random::of_part(seed, u64::MAX / 2).next_u64();
    for (module, make) in (0..).zip(makes) {
        let mut random = Random::of_part(seed, module);
        for assumption in Assumption::ALL {
            let percent = variations.iter().find(|it| it.of == assumption).map_or(0.0, |it| it.percent);
            assumption.vary(make, percent / 100.0, &mut random);
        }
    }
}

#[cfg(test)]
mod tests {
    use plants::motor::Motor;

    use super::*;

    fn varied(texts: &[&str], seed: u64) -> Vec<Make> {
        let mut makes = vec![Make::default(); 100];
        let variations: Vec<Variation> = texts.iter().map(|text| text.parse().unwrap()).collect();
        vary(&mut makes, &variations, seed);
        makes
    }

    /// The values of all assumptions but the last four, as multiples of what they are without variation.
    fn multiples(make: &Make) -> [f64; 6] {
        let values = |Make { mass, grip, motor, .. }: &Make| {
            let Motor { stall_torque, stall_current, sliding_friction, gear_inertia, .. } = *motor;
            [*mass, *grip, stall_torque, stall_current, sliding_friction, gear_inertia]
        };
        let [varied, usual] = [make, &Make::default()].map(values);
        std::array::from_fn(|index| varied[index] / usual[index])
    }

    #[test]
    fn what_is_named_differs_from_module_to_module_by_no_more_than_is_said() {
        for (named, assumption) in Assumption::ALL[..6].iter().enumerate() {
            for (text, range) in [
                ("20%", [0.8, 0.85, 1.15, 1.2]),
                ("90%", [0.1, 0.2, 1.8, 1.9]),
                ("1e0%", [0.99, 0.993, 1.007, 1.01]),
                ("-0%", [1.0; 4]),
            ] {
                let varied = varied(&[&format!("{}={text}", assumption.name())], 1);
                for (index, usual) in [1.0; 6].into_iter().enumerate() {
                    let values = varied.iter().map(|make| multiples(make)[index]);
                    let least = values.clone().fold(f64::INFINITY, f64::min);
                    let most = values.clone().fold(0.0, f64::max);
                    let [from, low, high, to] = if index == named { range } else { [usual; 4] };
                    assert!(
                        (from..=low).contains(&least) && (high..=to).contains(&most),
                        "{assumption:?} {text}: {least} to {most} of value {index}"
                    );
                    let mean = values.sum::<f64>() / varied.len() as f64;
                    assert!((mean - 1.0).abs() < (to - from) / 8.0 + 1e-9, "{assumption:?} {text}: {mean}");
                }
                assert!(varied.iter().all(|make| make.zeros == [0.0; 3] && make.noise == 0.0));
                assert!(varied.iter().all(|make| make.backlash == 0.0 && make.misses == 0.0));
            }
        }
    }

    #[test]
    fn potentiometers_sit_turned_each_for_itself() {
        let zeros: Vec<f64> = varied(&["potentiometer=1%"], 1).iter().flat_map(|make| make.zeros).collect();
        let most = zeros.iter().map(|zero| zero.abs()).fold(0.0, f64::max);
        assert!((2.8..=3.008).contains(&most), "{most} degrees");
        assert!(zeros.windows(2).all(|pair| pair[0] != pair[1]));
    }

    #[test]
    fn readings_are_noisy_alike_in_all_modules_and_each_for_itself() {
        let makes = varied(&["converter=0.4%"], 1);
        assert!(makes.iter().all(|make| make.noise == 0.004));
        assert!(makes.windows(2).all(|pair| pair[0].noise_seed != pair[1].noise_seed));
    }

    #[test]
    fn all_gears_have_the_backlash_that_is_said() {
        assert!(varied(&["backlash=1%"], 1).iter().all(|make| (make.backlash - 3.008).abs() < 1e-9));
    }

    #[test]
    fn all_hooks_miss_as_often_as_is_said_and_each_for_itself() {
        let makes = varied(&["hooks=30%"], 1);
        assert!(makes.iter().all(|make| make.misses == 0.3));
        assert!(makes.windows(2).all(|pair| pair[0].hooks_seed != pair[1].hooks_seed));
    }

    #[test]
    fn the_seed_alone_decides() {
        assert_eq!(varied(&["mass=20%"], 1), varied(&["mass=20%"], 1));
        assert_ne!(varied(&["mass=20%"], 1), varied(&["mass=20%"], 2));
    }

    #[test]
    fn the_value_of_an_assumption_does_not_depend_on_whether_others_are_varied() {
        let texts = Assumption::ALL.map(|assumption| format!("{}=20%", assumption.name()));
        let mut all = texts.each_ref().map(String::as_str);
        all.reverse();
        let together = varied(&all, 7);
        for (index, text) in texts.iter().enumerate() {
            for (one, together) in varied(&[text], 7).iter().zip(&together) {
                let same = match index {
                    6 => one.zeros == together.zeros,
                    7 => (one.noise, one.noise_seed) == (together.noise, together.noise_seed),
                    8 => one.backlash == together.backlash,
                    9 => (one.misses, one.hooks_seed) == (together.misses, together.hooks_seed),
                    _ => multiples(one)[index] == multiples(together)[index],
                };
                assert!(same, "{text}: {one:?} and {together:?}");
            }
        }
    }

    #[test]
    fn a_variation_is_read_and_told() {
        for (text, told) in [
            ("mass=20%", "mass 20 %"),
            ("gear-inertia=0.5%", "gear-inertia 0.5 %"),
            ("torque=-0%", "torque 0 %"),
            ("potentiometer=90%", "potentiometer 90 %"),
            ("converter=0.2%", "converter 0.2 %"),
        ] {
            assert_eq!(text.parse::<Variation>().map(|variation| variation.to_string()), Ok(told.into()));
        }
    }

    #[test]
    fn what_is_no_variation_is_refused() {
        for (text, error) in [
            ("mass", VariationError::Form),
            ("mass=20", VariationError::Form),
            ("mass=much%", VariationError::Form),
            ("colour=20%", VariationError::Name),
            ("mass=90.1%", VariationError::Range),
            ("mass=-1%", VariationError::Range),
            ("mass=NaN%", VariationError::Range),
        ] {
            assert_eq!(text.parse::<Variation>(), Err(error), "{text}");
        }
    }
}
