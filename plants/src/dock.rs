//! A dock: its latch with motor and end switches, and what its infrared receives from another dock.
//!
//! Docks have no gender, and either of two can attach and detach both, as SuperBot's can (SINGO: Shen, Kovac
//! and Rubenstein, 2009). The mechanism is assumed: hooks that hold each other move as one, whichever motor
//! drives them.

/// The time of the latch's travel from one end to the other, in s. Assumed.
const TRAVEL_SECONDS: f64 = 0.8;

/// The distance from either end within which its switch is pressed, of the travel's length of 1.
const SWITCH: f64 = 0.02;

/// The motor's current, in A, while it moves the latch, and while something holds the latch. Assumed.
const RUNNING_AMPERES: f64 = 0.2;
const STALLED_AMPERES: f64 = 0.9;

/// A latch and its motor.
#[derive(Clone, Debug)]
pub struct Latch {
    /// 0 is released, 1 is latched.
    way: f64,
    amperes: f64,
    /// The latch can't move past this, or from where it is beyond it.
    pub blocked_at: Option<f64>,
    /// Whether the switch at the latched end never closes.
    pub switch_is_broken: bool,
}

impl Latch {
    /// A latch at `way`: 0 is released, 1 is latched.
    pub fn at(way: f64) -> Self {
        Latch { way, amperes: 0.0, blocked_at: None, switch_is_broken: false }
    }

    /// Drives the motor for `seconds`: towards latched if positive, towards released if negative.
    pub fn step(&mut self, direction: i8, seconds: f64) {
        let wanted = self.way + f64::from(direction.signum()) * seconds / TRAVEL_SECONDS;
        let most = self.blocked_at.map_or(1.0, |blocked_at| blocked_at.max(self.way));
        let way = wanted.clamp(0.0, most);
        self.amperes = match direction {
            0 => 0.0,
            _ if way == wanted => RUNNING_AMPERES,
            _ => STALLED_AMPERES,
        };
        self.way = way;
    }

    /// The latch's position: 0 is released, 1 is latched.
    pub fn way(&self) -> f64 {
        self.way
    }

    /// The motor's current, in A.
    pub fn amperes(&self) -> f64 {
        self.amperes
    }

    /// Whether the switch at the released end is pressed.
    pub fn is_released(&self) -> bool {
        self.way <= SWITCH
    }

    /// Whether the switch at the latched end is pressed.
    pub fn is_latched(&self) -> bool {
        self.way >= 1.0 - SWITCH && !self.switch_is_broken
    }
}

/// The converter's counts where two docks touch face to face. Assumed.
const REFLECTED_AT_CONTACT: f64 = 800.0;

/// The angle between two docks, in degrees, at which 1/e of that is left. Assumed.
const LOBE_DEGREES: f64 = 12.0;

/// The distance, in mm, at which half of it is left. Assumed.
const HALF_DISTANCE: f64 = 15.0;

/// The reading, 0 to 1023, of a dock's own light that is reflected by a dock `millimetres` away and `degrees`
/// askew.
pub fn reflected(millimetres: f64, degrees: f64) -> u16 {
    let lobe = (-(degrees / LOBE_DEGREES).powi(2)).exp();
    (REFLECTED_AT_CONTACT * lobe / (1.0 + (millimetres / HALF_DISTANCE).powi(2))) as u16
}

/// The distance between two docks, in mm, up to which the infrared of one reaches the other. Assumed: ten
/// times as far as hooks, for what is received is brighter than what is reflected.
pub const SIGHT: f64 = 150.0;

/// The angle, in degrees, up to which it does. Assumed.
const SIGHT_TURN: f64 = 45.0;

/// Whether a dock `millimetres` away and `degrees` askew hears what this one sends.
pub fn hears(millimetres: f64, degrees: f64) -> bool {
    millimetres <= SIGHT && degrees.abs() <= SIGHT_TURN
}

/// The distance between two docks, in mm, up to which the hooks of one catch the other. Assumed.
const HOOKS_REACH: f64 = 12.0;

/// The angle, in degrees, up to which they do. Assumed.
const HOOKS_TURN: f64 = 12.0;

/// Whether a closing latch catches a dock `millimetres` away and `degrees` askew.
pub fn catches(millimetres: f64, degrees: f64) -> bool {
    millimetres <= HOOKS_REACH && degrees.abs() <= HOOKS_TURN
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_latch_travels_from_one_switch_to_the_other_and_stalls_at_the_end() {
        let mut latch = Latch::at(0.0);
        latch.step(1, TRAVEL_SECONDS / 2.0);
        assert_eq!((latch.way(), latch.amperes()), (0.5, RUNNING_AMPERES));
        assert!(!latch.is_released() && !latch.is_latched());
        latch.step(1, TRAVEL_SECONDS);
        assert_eq!((latch.way(), latch.amperes()), (1.0, STALLED_AMPERES));
        assert!(!latch.is_released() && latch.is_latched());
        latch.step(0, TRAVEL_SECONDS);
        assert_eq!((latch.way(), latch.amperes()), (1.0, 0.0));
        latch.step(-1, 2.0 * TRAVEL_SECONDS);
        assert_eq!((latch.way(), latch.amperes()), (0.0, STALLED_AMPERES));
        assert!(latch.is_released() && !latch.is_latched());
    }

    #[test]
    fn switches_close_shortly_before_the_ends() {
        assert!(Latch::at(SWITCH).is_released() && !Latch::at(SWITCH + 0.001).is_released());
        assert!(Latch::at(1.0 - SWITCH).is_latched() && !Latch::at(1.0 - SWITCH - 0.001).is_latched());
        let broken = Latch { switch_is_broken: true, ..Latch::at(1.0) };
        assert!(!broken.is_latched() && !broken.is_released());
    }

    #[test]
    fn an_obstacle_holds_a_latch_where_it_is_and_lets_it_go_back() {
        let mut latch = Latch { blocked_at: Some(0.25), ..Latch::at(0.0) };
        latch.step(1, TRAVEL_SECONDS);
        assert_eq!((latch.way(), latch.amperes()), (0.25, STALLED_AMPERES));
        let mut beyond = Latch { blocked_at: Some(0.25), ..Latch::at(0.75) };
        beyond.step(1, TRAVEL_SECONDS);
        assert_eq!((beyond.way(), beyond.amperes()), (0.75, STALLED_AMPERES));
        beyond.step(-1, TRAVEL_SECONDS / 4.0);
        assert_eq!((beyond.way(), beyond.amperes()), (0.5, RUNNING_AMPERES));
    }

    #[test]
    fn less_light_comes_back_from_a_dock_that_is_farther_away_or_more_askew() {
        assert_eq!(reflected(0.0, 0.0), 800);
        assert_eq!(reflected(HALF_DISTANCE, 0.0), 400);
        assert_eq!(reflected(2.0 * HALF_DISTANCE, 0.0), 160);
        assert_eq!([LOBE_DEGREES, -LOBE_DEGREES].map(|askew| reflected(0.0, askew)), [294; 2]);
        assert_eq!(reflected(HALF_DISTANCE, LOBE_DEGREES), 147);
    }

    #[test]
    fn a_dock_is_heard_from_farther_away_than_hooks_reach_and_more_askew() {
        assert!(hears(SIGHT, SIGHT_TURN) && hears(SIGHT, -SIGHT_TURN));
        assert!(!hears(SIGHT + 0.1, 0.0));
        assert!(!hears(0.0, SIGHT_TURN + 0.1) && !hears(0.0, -SIGHT_TURN - 0.1));
    }

    #[test]
    fn hooks_catch_a_dock_that_is_close_and_hardly_askew() {
        assert!(catches(HOOKS_REACH, HOOKS_TURN) && catches(HOOKS_REACH, -HOOKS_TURN));
        assert!(!catches(HOOKS_REACH + 0.1, 0.0));
        assert!(!catches(0.0, HOOKS_TURN + 0.1) && !catches(0.0, -HOOKS_TURN - 0.1));
    }
}
