//! The noise of converters.

use plants::joint::{REFERENCE_VOLTS, counts};

use crate::random::Random;

/// By how much each reading of a converter is off.
#[derive(Clone, Debug)]
pub struct Noise {
    most: f64,
    random: Random,
}

impl Default for Noise {
    /// None.
    fn default() -> Self {
        Self::new(0.0, 0)
    }
}

impl Noise {
    /// Readings are off by up to `most`, up or down, evenly spread; in shares of full scale. `seed` decides
    /// on each of them.
    pub fn new(most: f64, seed: u64) -> Self {
        Noise { most, random: Random::new(seed) }
    }

    /// As much noise, drawn anew.
    #[must_use]
    pub fn another(&mut self) -> Self {
        Self::new(self.most, self.random.next_u64())
    }

    /// By how much the next reading is off, as a share of full scale.
    pub fn draw(&mut self) -> f64 {
        self.random.between(-self.most, self.most)
    }

    /// The converter's next reading, of this voltage.
    pub fn read(&mut self, volts: f64) -> u16 {
        counts(volts + self.draw() * REFERENCE_VOLTS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_are_off_by_as_much_as_is_said() {
        let mut noise = Noise::new(0.002, 7);
        for mut noise in [noise.another(), noise] {
            let drawn: Vec<f64> = (0..1_000).map(|_| noise.draw()).collect();
            let [least, most] =
                [f64::min, f64::max].map(|of: fn(f64, f64) -> f64| drawn.iter().copied().fold(0.0, of));
            assert!(
                (-0.002..-0.0019).contains(&least) && (0.0019..=0.002).contains(&most),
                "{least}, {most}"
            );
            let mean = drawn.iter().sum::<f64>() / 1_000.0;
            assert!(mean.abs() < 2e-4, "{mean}");
        }
    }

    #[test]
    fn converters_have_their_own_and_without_any_readings_are_exact() {
        let mut noise = Noise::new(1.0, 7);
        let mut others = [noise.another(), noise.another()];
        let drawn = others.each_mut().map(Noise::draw);
        assert_ne!(drawn[0], drawn[1]);
        assert_eq!(Noise::default().draw(), 0.0);
    }
}
