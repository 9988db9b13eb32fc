//! The battery of a module: two Li-ion cells.

/// The capacity, in coulombs: 1600 mAh (Salemi, Moll and Shen, 2006).
pub const CAPACITY: f64 = 1.6 * 3600.0;

/// The voltage at rest, in V, empty and full. A straight line between is assumed.
const EMPTY_VOLTS: f64 = 6.2;
const FULL_VOLTS: f64 = 8.4;

/// The internal resistance, in ohms. Assumed.
const RESISTANCE: f64 = 0.15;

/// The current of a module's electronics, in A. Assumed.
pub const IDLE_AMPERES: f64 = 0.1;

/// The charge of a module's battery at power-up, of 1. Assumed.
const BEGINS: f64 = 0.9;

/// A battery.
#[derive(Clone, Debug)]
pub struct Battery {
    /// The charge that is left, of 1.
    charge: f64,
    /// The current that it delivers, in A.
    amperes: f64,
    /// The temperature, in degrees Celsius.
    pub celsius: f64,
}

impl Battery {
    /// A battery with `charge` left, of 1, at room temperature.
    pub fn with(charge: f64) -> Self {
        Battery { charge, amperes: 0.0, celsius: 25.0 }
    }

    /// A battery with the charge of a module at power-up.
    pub fn at_power_up() -> Self {
        Self::with(BEGINS)
    }

    /// The charge that was taken out since power-up, of a full charge.
    pub fn used(&self) -> f64 {
        BEGINS - self.charge
    }

    /// Draws `amperes` for `seconds`; a negative current charges.
    pub fn step(&mut self, amperes: f64, seconds: f64) {
        self.amperes = amperes;
        self.charge = (self.charge - amperes * seconds / CAPACITY).clamp(0.0, 1.0);
    }

    /// The charge that is left, of 1.
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

    #[test]
    fn what_was_used_counts_from_power_up() {
        let mut battery = Battery::at_power_up();
        assert_eq!(battery.used(), 0.0);
        battery.step(1.6, 360.0);
        assert!((battery.used() - 0.1).abs() < 1e-9);
    }
}
