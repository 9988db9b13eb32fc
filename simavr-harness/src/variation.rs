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
}

impl Assumption {
    pub const ALL: [Self; 7] = [
        Self::Mass,
        Self::Friction,
        Self::Torque,
        Self::Current,
        Self::GearFriction,
        Self::GearInertia,
        Self::Potentiometer,
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
         gear-friction, gear-inertia, potentiometer"
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
    use super::*;

    fn varied(texts: &[&str], seed: u64) -> Vec<Make> {
        let mut makes = vec![Make::default(); 100];
        let variations: Vec<Variation> = texts.iter().map(|text| text.parse().unwrap()).collect();
        vary(&mut makes, &variations, seed);
        makes
    }

    #[test]
    fn modules_differ_by_no_more_than_is_said() {
        let masses: Vec<f64> = varied(&["mass=20%"], 1).iter().map(|make| make.mass).collect();
        let least = masses.iter().copied().fold(f64::INFINITY, f64::min);
        let most = masses.iter().copied().fold(0.0, f64::max);
        assert!((0.8..0.85).contains(&least) && (1.15..1.2).contains(&most), "{least} to {most}");
        let mean = masses.iter().sum::<f64>() / 100.0;
        assert!((0.95..1.05).contains(&mean), "{mean}");
    }

    #[test]
    fn what_is_not_named_stays_as_it_is_assumed() {
        for (make, mass) in varied(&["friction=50%", "torque=10%"], 7).iter().zip(varied(&["mass=50%"], 7)) {
            assert!(make.grip != 1.0 && make.motor.stall_torque != Make::default().motor.stall_torque);
            let usual = Make { grip: make.grip, ..Make::default() };
            assert_eq!((make.mass, make.motor.gear_inertia), (usual.mass, usual.motor.gear_inertia));
            assert_eq!(mass.motor, Make::default().motor);
        }
    }

    #[test]
    fn potentiometers_sit_turned_each_for_itself() {
        let zeros: Vec<f64> = varied(&["potentiometer=1%"], 1).iter().flat_map(|make| make.zeros).collect();
        let most = zeros.iter().map(|zero| zero.abs()).fold(0.0, f64::max);
        assert!((2.8..=3.008).contains(&most), "{most} degrees");
        assert!(zeros.windows(2).all(|pair| pair[0] != pair[1]));
        assert!(varied(&["mass=20%"], 1).iter().all(|make| make.zeros == [0.0; 3]));
    }

    #[test]
    fn the_seed_alone_decides() {
        assert_eq!(varied(&["mass=20%"], 1), varied(&["mass=20%"], 1));
        assert_ne!(varied(&["mass=20%"], 1), varied(&["mass=20%"], 2));
        let both = varied(&["torque=5%", "mass=20%"], 1);
        assert!(both.iter().zip(varied(&["mass=20%"], 1)).all(|(both, one)| both.mass == one.mass));
    }

    #[test]
    fn what_is_no_variation_is_refused() {
        for (text, error) in [
            ("mass", VariationError::Form),
            ("mass=20", VariationError::Form),
            ("mass=much%", VariationError::Form),
            ("colour=20%", VariationError::Name),
            ("mass=91%", VariationError::Range),
            ("mass=-1%", VariationError::Range),
            ("mass=NaN%", VariationError::Range),
        ] {
            assert_eq!(text.parse::<Variation>(), Err(error), "{text}");
        }
    }
}
