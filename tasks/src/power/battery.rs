//! How full the battery is, by its voltage.

/// How full the battery is. Each level sheds one load more, in this order: what a robot can best do without
/// goes first, and a module goes on talking to the last.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
#[repr(u8)]
pub enum Level {
    /// All loads are on.
    Good = 0,
    /// No power for neighbours: the docks' switches are open.
    Low = 1,
    /// No docking either: a latch that moves comes to rest where it is.
    VeryLow = 2,
    /// The joints are off too. The links stay on, so that a neighbour can be asked for power.
    Empty = 3,
}

impl Level {
    /// The level with this code; `None` above 3.
    pub const fn from_code(code: u8) -> Option<Level> {
        match code {
            0 => Some(Level::Good),
            1 => Some(Level::Low),
            2 => Some(Level::VeryLow),
            3 => Some(Level::Empty),
            _ => None,
        }
    }

    /// The voltage, in mV, below which the battery has this level or a lower one: two Li-ion cells are empty
    /// at 6 V.
    fn threshold(self) -> u16 {
        match self {
            Level::Good => u16::MAX,
            Level::Low => 7_000,
            Level::VeryLow => 6_700,
            Level::Empty => 6_400,
        }
    }

    fn below(self) -> Level {
        Level::from_code(self as u8 + 1).unwrap_or(Level::Empty)
    }

    fn above(self) -> Level {
        Level::from_code((self as u8).wrapping_sub(1)).unwrap_or(Level::Good)
    }
}

/// A level ends this far above its threshold, in mV: without the load that was shed the voltage rises.
const HYSTERESIS: u16 = 300;

/// Looks in a row that must agree: a motor that starts pulls the voltage down for a moment.
const PATIENCE: u8 = 4;

/// After so many looks at one voltage, any level has changed to the one that they see.
pub const SETTLES: u8 = 3 * PATIENCE;

/// The battery, as it was seen over time.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Battery {
    level: Level,
    /// What the last looks saw, and how many of them in a row.
    seen: Level,
    agreeing: u8,
}

impl Default for Battery {
    fn default() -> Self {
        Self::new()
    }
}

impl Battery {
    /// A battery that counts as full until it is seen.
    pub const fn new() -> Self {
        Battery { level: Level::Good, seen: Level::Good, agreeing: 0 }
    }

    /// How full it is.
    pub fn level(&self) -> Level {
        self.level
    }

    /// A look, a quarter of a second after the one before. `voltage` is in mV. Returns the level if it
    /// changed: by one at a time.
    pub fn look(&mut self, voltage: u16) -> Option<Level> {
        let below = self.level.below();
        let next = if voltage < below.threshold() {
            below
        } else if voltage >= self.level.threshold().saturating_add(HYSTERESIS) {
            self.level.above()
        } else {
            self.level
        };
        if next != self.seen {
            (self.seen, self.agreeing) = (next, 0);
        }
        if next == self.level {
            return None;
        }
        self.agreeing += 1;
        if self.agreeing < PATIENCE {
            return None;
        }
        self.level = next;
        Some(next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Looks until the level has had time to settle.
    fn settle(battery: &mut Battery, voltage: u16) -> Level {
        for _ in 0..SETTLES {
            battery.look(voltage);
        }
        battery.level()
    }

    #[test]
    fn a_level_ends_above_where_it_began() {
        let mut battery = Battery::new();
        for (voltage, expected) in [
            (8_400, Level::Good),
            (7_000, Level::Good),
            (6_999, Level::Low),
            (6_699, Level::VeryLow),
            (6_399, Level::Empty),
            (6_699, Level::Empty),
            (6_700, Level::VeryLow),
            (7_000, Level::Low),
            (7_299, Level::Low),
            (7_300, Level::Good),
            (u16::MAX, Level::Good),
        ] {
            assert_eq!(settle(&mut battery, voltage), expected, "{voltage} mV");
        }
    }

    #[test]
    fn a_level_begins_below_its_threshold() {
        for (voltage, level) in [(7_000, Level::Good), (6_999, Level::Low)] {
            let mut battery = Battery::new();
            for _ in 0..PATIENCE {
                battery.look(voltage);
            }
            assert_eq!(battery.level(), level);
        }
    }

    #[test]
    fn looks_that_say_different_things_do_not_agree() {
        let mut battery = Battery::new();
        assert_eq!(settle(&mut battery, 6_650), Level::VeryLow);
        // It recovers for three looks; then a motor starts.
        for voltage in [7_050, 7_050, 7_050, 6_350, 6_350, 6_350, 7_050] {
            assert_eq!(battery.look(voltage), None, "{voltage} mV");
        }
    }

    #[test]
    fn a_short_sag_sheds_nothing() {
        let mut battery = Battery::new();
        for _ in 0..100 {
            for _ in 1..PATIENCE {
                assert_eq!(battery.look(6_000), None);
            }
            assert_eq!(battery.look(7_400), None);
        }
    }

    proptest! {
        /// At one voltage the level settles, and then stays: it does not flutter.
        #[test]
        fn a_level_settles(before: u16, voltage: u16) {
            let mut battery = Battery::new();
            settle(&mut battery, before);
            let settled = settle(&mut battery, voltage);
            for _ in 0..50 {
                prop_assert_eq!(battery.look(voltage), None);
            }
            prop_assert_eq!(battery.level(), settled);
        }

        /// A level changes by one step at a time.
        #[test]
        fn levels_follow_one_another(voltages in prop::collection::vec(any::<u16>(), 1..200)) {
            let mut battery = Battery::new();
            for voltage in voltages {
                let before = battery.level() as i8;
                battery.look(voltage);
                prop_assert!((battery.level() as i8 - before).abs() <= 1);
            }
        }
    }
}
