//! The battery of a module: two Li-ion cells.

/// What it holds when full, in coulombs: 1600 mAh (Salemi, Moll and Shen, 2006).
pub const CAPACITY: f64 = 1.6 * 3600.0;

/// Its voltage at rest, in V, empty and full. A straight line between is assumed.
const EMPTY_VOLTS: f64 = 6.2;
const FULL_VOLTS: f64 = 8.4;

/// Its resistance, in ohms. Assumed.
const RESISTANCE: f64 = 0.15;

/// What the electronics of a module take, in A. Assumed.
pub const IDLE_AMPERES: f64 = 0.1;

/// A module's battery at power-up. Assumed.
const BEGINS: f64 = 0.9;

/// A battery.
#[derive(Clone, Debug)]
pub struct Battery {
    /// What is left, of 1.
    charge: f64,
    /// What it gives, in A.
    amperes: f64,
    /// In degrees Celsius.
    pub celsius: f64,
}

impl Battery {
    /// A battery with `charge` left, of 1, at room temperature.
    pub fn with(charge: f64) -> Self {
        Battery { charge, amperes: 0.0, celsius: 25.0 }
    }

    /// A battery as modules have it at power-up.
    pub fn at_power_up() -> Self {
        Self::with(BEGINS)
    }

    /// What was taken out since power-up, of a full charge.
    pub fn used(&self) -> f64 {
        BEGINS - self.charge
    }

    /// Takes a current out, in A, or gives one in, for `seconds`.
    pub fn step(&mut self, amperes: f64, seconds: f64) {
        self.amperes = amperes;
        self.charge = (self.charge - amperes * seconds / CAPACITY).clamp(0.0, 1.0);
    }

    /// What is left, of 1.
    pub fn charge(&self) -> f64 {
        self.charge
    }

    /// Its voltage under the present current, in V.
    pub fn volts(&self) -> f64 {
        EMPTY_VOLTS + (FULL_VOLTS - EMPTY_VOLTS) * self.charge - RESISTANCE * self.amperes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ampere_empties_it_in_an_hour_and_36_minutes() {
        let mut battery = Battery::with(1.0);
        battery.step(0.0, 1.0);
        assert_eq!(battery.volts(), FULL_VOLTS);
        battery.step(1.0, 95.0 * 60.0);
        assert!(battery.charge() > 0.0 && battery.volts() < EMPTY_VOLTS);
        battery.step(1.0, 2.0 * 60.0);
        assert_eq!(battery.charge(), 0.0);
        battery.step(-0.8, 3600.0);
        assert!((battery.charge() - 0.5).abs() < 1e-9);
    }
}
