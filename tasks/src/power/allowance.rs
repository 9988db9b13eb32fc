//! What a module may switch on, by the state of its supply.

use super::battery::Level;

/// What the battery allows. Each [`Level`] forbids one load more.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub struct Allowance {
    pub level: Level,
    /// Whether the battery is being charged. The power comes in through a dock, so docks' switches may be
    /// closed however empty the battery is.
    pub is_charging: bool,
}

impl Allowance {
    /// What a good battery allows.
    pub const ALL: Allowance = Allowance { level: Level::Good, is_charging: false };

    /// Whether docks may be joined to neighbours' supplies.
    pub fn neighbours(self) -> bool {
        self.level < Level::Low || self.is_charging
    }

    /// Whether docking motors may run.
    pub fn docking(self) -> bool {
        self.level < Level::VeryLow
    }

    /// Whether joints may be driven.
    pub fn joints(self) -> bool {
        self.level < Level::Empty
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_level_forbids_one_load_more() {
        let loads = |level, is_charging| {
            let allowance = Allowance { level, is_charging };
            [allowance.neighbours(), allowance.docking(), allowance.joints()]
        };
        assert_eq!(loads(Level::Good, false), [true, true, true]);
        assert_eq!(loads(Level::Low, false), [false, true, true]);
        assert_eq!(loads(Level::VeryLow, false), [false, false, true]);
        assert_eq!(loads(Level::Empty, false), [false, false, false]);
    }

    #[test]
    fn an_empty_module_can_be_charged_and_does_nothing_else() {
        let empty = Allowance { level: Level::Empty, is_charging: true };
        assert!(empty.neighbours() && !empty.docking() && !empty.joints());
    }
}
