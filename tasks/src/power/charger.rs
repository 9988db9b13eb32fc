//! Charging the battery from a neighbour, through a dock.
//!
//! The dock's switch joins the supplies of both modules; the charger takes from there what the battery gets.
//! The behaviours of both modules find out whether the neighbour has power to give; here it shows as a
//! current, or as none.

/// The state of the charger.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
#[repr(u8)]
pub enum State {
    Off = 0,
    Charging = 1,
    /// The battery is too cold or too hot; charging goes on when that is over.
    Paused = 2,
    /// The battery is full.
    Full = 3,
    /// Nothing comes in, or the battery does not get full.
    Failed = 4,
}

impl State {
    /// The state with this code; `None` above 4.
    pub const fn from_code(code: u8) -> Option<State> {
        match code {
            0 => Some(State::Off),
            1 => Some(State::Charging),
            2 => Some(State::Paused),
            3 => Some(State::Full),
            4 => Some(State::Failed),
            _ => None,
        }
    }
}

/// After so many looks in a row without current, a quarter of a second apart, none comes in: 2 s. A single
/// measurement can be lost where the other MCU makes it.
const PATIENCE: u16 = 8;

/// Looks after which a battery that is not full never will be: 4 h.
const TIME_OUT: u16 = 4 * 60 * 60 * 4;

/// The voltage, in mV, from which on a battery that takes no more is full. Two Li-ion cells are at 8.4 V
/// then, and the measurement may be off by a percent.
const FULL: u16 = 8_300;

/// The current, in mA, below which a battery at its full voltage takes no more.
const TAPER: u16 = 80;

/// The temperatures, in 0.1 degree Celsius, between which Li-ion cells may be charged; and how far inside
/// these they must be to go on.
const COLD: i16 = 0;
const HOT: i16 = 450;
const HYSTERESIS: i16 = 30;

/// What a look sees.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Look {
    /// The battery's, in mV.
    pub voltage: u16,
    /// The battery's, in 0.1 degree Celsius.
    pub temperature: i16,
    /// The current that comes in through the docks, in mA.
    pub current: u16,
}

/// The charger.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Charger {
    state: State,
    /// Looks since it began.
    looks: u16,
    /// Looks in a row without current.
    without: u16,
}

impl Default for Charger {
    fn default() -> Self {
        Self::new()
    }
}

impl Charger {
    /// A charger that is off.
    pub const fn new() -> Self {
        Charger { state: State::Off, looks: 0, without: 0 }
    }

    /// Its state.
    pub fn state(&self) -> State {
        self.state
    }

    /// Whether it is to be on. While it pauses, the battery can't count on any power that comes in.
    pub fn is_on(&self) -> bool {
        self.state == State::Charging
    }

    /// Begins to charge. A charger that charges or pauses goes on: else an order that is repeated would put
    /// off its limits, and charge a hot battery.
    pub fn start(&mut self) {
        if !matches!(self.state, State::Charging | State::Paused) {
            *self = Charger { state: State::Charging, looks: 0, without: 0 };
        }
    }

    /// Ends charging.
    pub fn stop(&mut self) {
        self.state = State::Off;
    }

    /// A look, a quarter of a second after the one before. Returns the state if it changed.
    pub fn look(&mut self, look: Look) -> Option<State> {
        let next = match self.state {
            State::Off | State::Full | State::Failed => return None,
            State::Charging => self.charge(look),
            State::Paused => {
                let inside = COLD + HYSTERESIS..=HOT - HYSTERESIS;
                if inside.contains(&look.temperature) { State::Charging } else { State::Paused }
            }
        };
        (core::mem::replace(&mut self.state, next) != next).then_some(next)
    }

    fn charge(&mut self, look: Look) -> State {
        self.looks = self.looks.saturating_add(1);
        if !(COLD..=HOT).contains(&look.temperature) {
            self.without = 0;
            return State::Paused;
        }
        self.without = if look.current < TAPER { self.without + 1 } else { 0 };
        if self.without < PATIENCE && self.looks < TIME_OUT {
            State::Charging
        } else if self.without >= PATIENCE && look.voltage >= FULL {
            State::Full
        } else {
            State::Failed
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    const GOOD: Look = Look { voltage: 7_400, temperature: 250, current: 500 };

    fn charging() -> Charger {
        let mut charger = Charger::new();
        charger.start();
        charger
    }

    #[test]
    fn a_battery_is_charged_until_it_takes_no_more() {
        let mut charger = charging();
        for voltage in 7_000..8_500 {
            assert_eq!(charger.look(Look { voltage, ..GOOD }), None);
        }
        let tapers = Look { voltage: 8_400, current: 79, ..GOOD };
        let looks = |charger: &mut Charger, looks| {
            (0..looks).map(|_| charger.look(tapers)).collect::<std::vec::Vec<_>>()
        };
        let nothing = [None; PATIENCE as usize - 1];
        assert_eq!(looks(&mut charger, PATIENCE - 1), nothing);
        assert_eq!(charger.look(GOOD), None, "its current was not measured for a moment");
        assert_eq!(looks(&mut charger, PATIENCE - 1), nothing);
        assert_eq!(charger.look(tapers), Some(State::Full));
        assert!(!charger.is_on());
        assert_eq!(charger.look(GOOD), None);
    }

    #[test]
    fn cold_and_heat_interrupt_it() {
        for (limit, bad, still, good) in [(0, -1, 29, 30), (450, 451, 421, 420)] {
            let mut charger = charging();
            // Nothing comes in from the neighbour; the time for that begins anew behind a pause.
            let mut at = |temperature| charger.look(Look { temperature, current: 0, ..GOOD });
            for _ in 1..2 * 4 {
                assert_eq!(at(limit), None);
            }
            assert_eq!(at(bad), Some(State::Paused));
            assert_eq!(at(still), None);
            assert_eq!(at(good), Some(State::Charging));
            for _ in 1..2 * 4 {
                assert_eq!(at(good), None);
            }
            assert_eq!(at(good), Some(State::Failed));
        }
    }

    #[test]
    fn two_seconds_tell_a_full_battery_from_a_neighbour_that_gives_nothing() {
        for (voltage, current, becomes) in [
            (8_300, 79, Some(State::Full)),
            (8_299, 79, Some(State::Failed)),
            (7_400, 0, Some(State::Failed)),
            (8_300, 80, None),
        ] {
            let mut charger = charging();
            let look = Look { voltage, current, ..GOOD };
            for _ in 1..2 * 4 {
                assert_eq!(charger.look(look), None);
            }
            assert_eq!(charger.look(look), becomes, "{voltage} mV, {current} mA");
        }
    }

    #[test]
    fn it_does_not_charge_for_ever() {
        let mut charger = charging();
        let looks = (1..).find(|_| charger.look(GOOD).is_some());
        assert_eq!((looks, charger.state()), (Some(4 * 3_600 * 4), State::Failed), "after four hours");
    }

    #[test]
    fn orders_that_are_repeated_put_none_of_its_limits_off() {
        let nothing = Look { current: 0, ..GOOD };
        for (looks, seen, expected) in [
            (u32::from(TIME_OUT), GOOD, State::Failed),
            (u32::from(PATIENCE), nothing, State::Failed),
            (100, Look { temperature: HOT + 1, ..GOOD }, State::Paused),
        ] {
            let mut charger = charging();
            for _ in 0..looks {
                charger.start();
                charger.look(seen);
            }
            assert_eq!(charger.state(), expected);
            charger.start();
            assert_eq!(charger.is_on(), expected == State::Failed, "what has failed is tried again");
        }
    }

    #[test]
    fn off_is_off() {
        let mut charger = charging();
        charger.stop();
        assert_eq!((charger.look(GOOD), charger.is_on()), (None, false));
    }
}
