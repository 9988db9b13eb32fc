//! A docking motor: it moves a dock's latch from one end switch to the other.

/// How often a motor is stepped, in ms.
pub const PERIOD_MS: u16 = 4;

/// A latch that has not arrived after this many milliseconds never will.
pub const LONGEST_MS: u16 = 2_000;

/// The same in periods.
const TIME_OUT: u16 = LONGEST_MS / PERIOD_MS;

/// Periods in a row with too much current that mean a jam: 40 ms, longer than a motor takes to start.
const JAM: u8 = 40 / PERIOD_MS as u8;

/// Where a latch is to go.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
#[repr(u8)]
pub enum End {
    Released = 0,
    Latched = 1,
}

/// The switches at a latch's ends: whether they are pressed.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub struct EndSwitches {
    pub is_released: bool,
    pub is_latched: bool,
}

impl EndSwitches {
    /// Whether a dock with these switches is open, so that it holds on to no other one: its latch is open for
    /// sure, or its motor is on. Where both switches are pressed one is broken.
    pub fn is_open(self, is_driven: bool) -> bool {
        is_driven || self.is_released && !self.is_latched
    }
}

/// Why a latch did not arrive. A new order makes the motor try again.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
#[repr(u8)]
pub enum Failure {
    /// It took too much current for too long.
    Jammed = 0,
    /// It did not press the switch in time.
    TimedOut = 1,
    /// Both switches are pressed at once: one is broken.
    Switches = 2,
}

/// The state of a latch.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub enum State {
    /// At rest between its ends, as it may be at power-up or when it was forced.
    Between,
    At(End),
    MovingTo(End),
    Failed(Failure),
}

impl State {
    /// The state's code in a report.
    pub const fn code(self) -> u8 {
        match self {
            State::Between => 0,
            State::At(end) => 1 + end as u8,
            State::MovingTo(end) => 3 + end as u8,
            State::Failed(failure) => 5 + failure as u8,
        }
    }

    /// The state with this code; `None` above 7.
    pub fn from_code(code: u8) -> Option<State> {
        match code {
            0 => Some(State::Between),
            1 => Some(State::At(End::Released)),
            2 => Some(State::At(End::Latched)),
            3 => Some(State::MovingTo(End::Released)),
            4 => Some(State::MovingTo(End::Latched)),
            5 => Some(State::Failed(Failure::Jammed)),
            6 => Some(State::Failed(Failure::TimedOut)),
            7 => Some(State::Failed(Failure::Switches)),
            _ => None,
        }
    }
}

/// One docking motor.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub struct DockingMotor {
    state: State,
    /// Periods since the motor was switched on.
    running: u16,
    /// Periods in a row with too much current.
    strained: u8,
}

impl Default for DockingMotor {
    fn default() -> Self {
        Self::new()
    }
}

impl DockingMotor {
    /// A motor that is off. The first step finds out where its latch is.
    pub const fn new() -> Self {
        DockingMotor { state: State::Between, running: 0, strained: 0 }
    }

    /// The state of the latch.
    pub fn state(&self) -> State {
        self.state
    }

    /// Whether the motor is on.
    pub fn is_running(&self) -> bool {
        matches!(self.state, State::MovingTo(_))
    }

    /// Moves the latch to `end`. A motor on its way there goes on: else an order that is repeated would put
    /// off the end of a jam.
    pub fn move_to(&mut self, end: End) {
        if self.state != State::MovingTo(end) {
            *self = DockingMotor { state: State::MovingTo(end), running: 0, strained: 0 };
        }
    }

    /// Switches the motor off, wherever the latch is.
    pub fn stop(&mut self) {
        self.state = State::Between;
    }

    /// One period. `is_strained`: the motor's current is above its limit. Returns where to drive the latch;
    /// `None` is off.
    pub fn step(&mut self, switches: EndSwitches, is_strained: bool) -> Option<End> {
        let at = match switches {
            EndSwitches { is_released: true, is_latched: true } => {
                self.state = State::Failed(Failure::Switches);
                return None;
            }
            EndSwitches { is_released: true, .. } => Some(End::Released),
            EndSwitches { is_latched: true, .. } => Some(End::Latched),
            _ => None,
        };
        match self.state {
            State::MovingTo(end) if at != Some(end) => self.go_on(end, is_strained),
            State::Failed(_) => None,
            _ => {
                self.state = at.map_or(State::Between, State::At);
                None
            }
        }
    }

    fn go_on(&mut self, end: End, is_strained: bool) -> Option<End> {
        self.running += 1;
        self.strained = if is_strained { self.strained + 1 } else { 0 };
        let failure = if self.strained >= JAM {
            Failure::Jammed
        } else if self.running > TIME_OUT {
            Failure::TimedOut
        } else {
            return Some(end);
        };
        self.state = State::Failed(failure);
        None
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn a_dock_is_open_only_where_one_switch_says_so_and_the_other_does_not_deny_it_or_the_motor_is_on() {
        for (is_released, is_latched) in [(true, false), (false, false), (false, true), (true, true)] {
            let switches = EndSwitches { is_released, is_latched };
            assert_eq!(switches.is_open(false), (is_released, is_latched) == (true, false), "{switches:?}");
            assert!(switches.is_open(true), "{switches:?}");
        }
    }

    /// Every state that any readings and orders lead to, and every reading in each of them.
    #[test]
    fn in_every_state_the_motor_is_off_unless_it_has_a_way_to_go() {
        let mut seen = HashSet::new();
        let mut open = std::vec![DockingMotor::new()];
        while let Some(motor) = open.pop() {
            if !seen.insert(motor) {
                continue;
            }
            for bits in 0..8 {
                let switches = EndSwitches { is_released: bits & 1 != 0, is_latched: bits & 2 != 0 };
                let mut next = motor;
                let drive = next.step(switches, bits & 4 != 0);
                assert_eq!(drive.is_some(), next.is_running());
                let is_broken = switches.is_released && switches.is_latched;
                assert!(!is_broken || next.state == State::Failed(Failure::Switches));
                match drive {
                    None => {}
                    Some(End::Released) => assert!(!switches.is_released),
                    Some(End::Latched) => assert!(!switches.is_latched),
                }
                // On its own a motor goes on where it was going, or stops.
                assert!(drive.is_none() || next.state() == motor.state());
                assert!(next.running <= TIME_OUT + 1 && next.strained <= JAM);
                // A motor that has failed stays so until there is an order.
                assert!(!matches!(motor.state, State::Failed(_)) || matches!(next.state, State::Failed(_)));
                open.push(next);
            }
            for end in [End::Released, End::Latched] {
                let mut ordered = motor;
                ordered.move_to(end);
                open.push(ordered);
            }
            let mut stopped = motor;
            stopped.stop();
            assert!(!stopped.is_running());
            open.push(stopped);
        }
        assert!(seen.len() > usize::from(TIME_OUT));
    }

    #[test]
    fn too_much_current_for_forty_milliseconds_on_end_is_a_jam() {
        let between = EndSwitches { is_released: false, is_latched: false };
        let jammed = State::Failed(Failure::Jammed);
        // Times with too much current, in ms, each with a period without it behind.
        for (strained, state) in [
            (&[36][..], State::MovingTo(End::Latched)),
            (&[40], jammed),
            (&[4, 36, 36, 8], State::MovingTo(End::Latched)),
            (&[36, 40], jammed),
        ] {
            let mut motor = DockingMotor::new();
            motor.move_to(End::Latched);
            for milliseconds in strained {
                (0..milliseconds / PERIOD_MS).for_each(|_| _ = motor.step(between, true));
                motor.step(between, false);
            }
            assert_eq!(motor.state(), state, "{strained:?}");
        }
    }
}
