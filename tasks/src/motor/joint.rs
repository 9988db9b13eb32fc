//! One joint: its target, its limits, and what may go wrong with it.

use super::pid::{Gains, Pid};
use super::potentiometer::Potentiometer;
use super::{DEGREE, FULL_DRIVE, Position, TENTH};

/// Of the controller of every joint, found by trial on the assumed plant; `tests/host/tests/joint.rs` holds
/// them to it.
const GAINS: Gains = Gains::new(12, 4, 12);

/// The setpoint waits for a joint that lags further behind than this.
const LARGEST_LAG: u16 = 5 * DEGREE as u16;

/// Further than this no joint turns in a period: such a reading is none of a working potentiometer.
const LARGEST_STEP: u16 = 3 * DEGREE as u16;

/// Readings in a row that must be bad before the potentiometer counts as broken. Meanwhile the motor is off.
const BAD_READINGS: u8 = 3;

/// The drive that a speed takes, as a shift of 1/256 units in a period: a free joint turns at 80 degrees per
/// second with full drive.
const DRIVE_OF_SPEED: u32 = 3;

/// Within this of its target a joint has arrived.
const ARRIVED: u16 = 3 * TENTH as u16;

/// A joint that moves less than this makes no way.
const WAY: u16 = DEGREE as u16;

/// A joint further than this from its target is meant to move.
const LARGE_ERROR: u16 = 2 * DEGREE as u16;

/// With this much drive a free joint moves.
const STRONG_DRIVE: u16 = FULL_DRIVE as u16 / 4;

/// Once in so many periods it is asked what has become of the drives: a power of two.
const REVIEW: u8 = 8;

/// Reviews without way, while the drive is strong or the current at its limit, that make a stall: 248 ms.
const STALL: u8 = 31;

/// Reviews that find the joint at its target, where the one before found it, after which it is at rest: 96
/// ms.
const SETTLED: u8 = 12;

/// Looks in a row that find a joint at rest off its target, after which it is at rest no longer: 256 ms.
const CREPT: u8 = 8;

/// How one joint is built and what it may do: the board says so.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Description {
    pub potentiometer: Potentiometer,
    /// The soft end stops, in 0.1 degree.
    pub lowest: i16,
    pub highest: i16,
    /// What the motor's current is kept below, as the converter reads it, 0 to 1023.
    pub current_limit: u16,
}

/// Why a joint does not do what it was told. A new target makes it try again.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
#[repr(u8)]
pub enum Fault {
    /// The potentiometer reads what no working one does: out of range, or further than the joint can have
    /// turned.
    Potentiometer = 0,
    /// The motor drives and the joint does not move.
    Stall = 1,
}

/// What a joint is doing.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub enum State {
    /// The motor is off.
    Off,
    /// On its way to the target.
    Moving,
    /// At the target, and kept there.
    Arrived,
    /// The motor is off, because of this.
    Failed(Fault),
}

impl State {
    /// The state's code in a report.
    pub fn code(self) -> u8 {
        match self {
            State::Off => 0,
            State::Moving => 1,
            State::Arrived => 2,
            State::Failed(fault) => 3 + fault as u8,
        }
    }

    /// The state with this code; `None` above 4.
    pub fn from_code(code: u8) -> Option<State> {
        match code {
            0 => Some(State::Off),
            1 => Some(State::Moving),
            2 => Some(State::Arrived),
            3 => Some(State::Failed(Fault::Potentiometer)),
            4 => Some(State::Failed(Fault::Stall)),
            _ => None,
        }
    }
}

/// What the converter reads of a joint, 0 to 1023 each.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Reading {
    pub potentiometer: u16,
    /// The motor's current.
    pub current: u16,
}

/// One joint, to be stepped each millisecond.
pub struct Joint {
    description: Description,
    state: State,
    target: Position,
    /// Where the joint should be by now, and 1/256 units more.
    setpoint: Position,
    fraction: u8,
    /// 1/256 units in a period.
    speed: u16,
    pid: Pid,
    /// The most drive with which the current stays below its limit.
    ceiling: i16,
    /// The last good reading's position; `None` before the first.
    position: Option<Position>,
    bad_readings: u8,
    /// Counts periods, for the reviews.
    period: u8,
    /// Where the joint was when it last made way, and the reviews in vain since.
    mark: Position,
    in_vain: u8,
    /// Where the joint has come to rest, and the reviews that found it there.
    rest: Position,
    settled: u8,
    /// The looks in a row that have found the joint off its target.
    off: u8,
}

impl Joint {
    /// A joint whose motor is off.
    pub const fn new(description: Description) -> Self {
        Joint {
            description,
            state: State::Off,
            target: 0,
            setpoint: 0,
            fraction: 0,
            speed: 0,
            pid: Pid::at(0),
            ceiling: FULL_DRIVE,
            position: None,
            bad_readings: 0,
            period: 0,
            mark: 0,
            in_vain: 0,
            rest: 0,
            settled: 0,
            off: 0,
        }
    }

    /// Turns the joint to `angle`, in 0.1 degree, at no more than `speed`, in degrees per second. An angle
    /// beyond an end stop counts as that stop.
    pub fn turn_to(&mut self, angle: i16, speed: u8) {
        // Positions hold both end stops, so the product fits.
        let Description { lowest, highest, .. } = self.description;
        self.target = angle.min(highest).max(lowest).wrapping_mul(TENTH);
        self.settled = 0;
        // 41/256 is a degree per second in units per millisecond: 0.16.
        self.speed = u16::from(speed) * 41;
        match self.state {
            State::Moving | State::Arrived => self.state = State::Moving,
            State::Off | State::Failed(_) => {
                self.state = State::Moving;
                self.bad_readings = 0;
                self.in_vain = 0;
                self.ceiling = FULL_DRIVE;
                // From where the next reading finds it.
                self.position = None;
            }
        }
    }

    /// Switches the motor off. The gear holds the joint, more or less.
    pub fn release(&mut self) {
        self.state = State::Off;
    }

    /// What the joint is doing.
    pub fn state(&self) -> State {
        self.state
    }

    /// Where the joint is; `None` before the first good reading.
    pub fn position(&self) -> Option<Position> {
        self.position
    }

    /// Whether the motor is on.
    pub fn is_driven(&self) -> bool {
        matches!(self.state, State::Moving | State::Arrived)
    }

    /// Whether nothing has to be done for the joint: it is off, or at rest with a drive that may stay as it
    /// is.
    pub fn is_at_rest(&self) -> bool {
        !self.is_driven() || self.settled >= SETTLED
    }

    /// Looks at a joint at rest. One that has been moved, or can't be measured, is at rest no longer; nor is one
    /// that a load has moved by no more than the converter's noise, but for good.
    pub fn watch(&mut self, reading: Reading) {
        let position = self.description.potentiometer.position(reading.potentiometer);
        let Some(at) = position.filter(|position| self.rests_at(*position)) else {
            self.settled = 0;
            // Since the last look it may have turned further than in a period.
            self.position = position.or(self.position);
            return;
        };
        self.off = if self.target.abs_diff(at) <= self.tolerance().unsigned_abs() { 0 } else { self.off + 1 };
        if self.off >= CREPT {
            (self.off, self.settled) = (0, 0);
        }
    }

    /// One period. Returns the drive, from -[`FULL_DRIVE`] to [`FULL_DRIVE`].
    #[inline(never)] // in a loop over joints the AVR would compute the address of each field anew
    pub fn step(&mut self, reading: Reading) -> i16 {
        let Some(position) = self.plausible(reading.potentiometer) else {
            self.bad_readings = self.bad_readings.saturating_add(1);
            if self.bad_readings >= BAD_READINGS && self.is_driven() {
                self.state = State::Failed(Fault::Potentiometer);
            }
            return 0;
        };
        if self.position.is_none() {
            self.begin(position);
        }
        self.bad_readings = 0;
        self.position = Some(position);
        if !self.is_driven() {
            return 0;
        }
        let feed_forward = self.advance_setpoint(position);
        self.limit_current(reading.current);
        let tolerance = self.tolerance();
        let sought = self.pid.step(GAINS, self.setpoint, position, tolerance, feed_forward, self.ceiling);
        let drive = self.stop_at_ends(position, sought);
        self.period = self.period.wrapping_add(1);
        if self.period & (REVIEW - 1) == 0 && !self.review(position, drive, reading.current) {
            return 0;
        }
        drive
    }

    /// The position, if it can be that of the joint.
    fn plausible(&self, reading: u16) -> Option<Position> {
        let position = self.description.potentiometer.position(reading)?;
        match self.position {
            Some(last) if position.abs_diff(last) > LARGEST_STEP => None,
            _ => Some(position),
        }
    }

    /// Starts from `position`, at rest.
    fn begin(&mut self, position: Position) {
        self.setpoint = position;
        self.fraction = 0;
        self.pid = Pid::at(position);
        self.mark = position;
    }

    /// Less than this makes no difference to where the joint is.
    fn tolerance(&self) -> Position {
        self.description.potentiometer.resolution() >> 1
    }

    /// Whether a position is where the joint has come to rest, but for the converter's noise.
    fn rests_at(&self, position: Position) -> bool {
        self.rest.abs_diff(position) <= self.description.potentiometer.resolution().unsigned_abs()
    }

    /// Moves the setpoint towards the target. Returns the drive that its motion takes.
    fn advance_setpoint(&mut self, position: Position) -> i16 {
        let left = self.target.abs_diff(self.setpoint);
        if left == 0 {
            return 0;
        }
        let drive = (self.speed >> DRIVE_OF_SPEED).min(FULL_DRIVE as u16) as i16;
        let is_upward = self.setpoint < self.target;
        if self.setpoint.abs_diff(position) <= LARGEST_LAG {
            let [fraction, step] = (self.speed + u16::from(self.fraction)).to_le_bytes();
            self.fraction = fraction;
            self.setpoint = match u16::from(step) {
                step if step >= left => self.target,
                _ if is_upward => self.setpoint + i16::from(step),
                _ => self.setpoint - i16::from(step),
            };
        }
        if is_upward { drive } else { -drive }
    }

    /// Lowers the ceiling by a sixteenth in each period with too much current, and raises it slowly in the
    /// others.
    fn limit_current(&mut self, current: u16) {
        self.ceiling = if current > self.description.current_limit {
            self.ceiling - (self.ceiling >> 4)
        } else {
            (self.ceiling + 1).min(FULL_DRIVE)
        };
    }

    /// No drive over an end stop.
    fn stop_at_ends(&self, position: Position, drive: i16) -> i16 {
        // As in `turn_to`.
        let lowest = self.description.lowest.wrapping_mul(TENTH);
        let highest = self.description.highest.wrapping_mul(TENTH);
        if (position >= highest && drive > 0) || (position <= lowest && drive < 0) { 0 } else { drive }
    }

    /// What has become of the drives. Returns whether the motor may stay on.
    #[inline(never)] // seldom called, it would cost the rest its registers
    fn review(&mut self, position: Position, drive: i16, current: u16) -> bool {
        let error = self.target.abs_diff(position);
        if self.setpoint == self.target && error <= ARRIVED {
            self.state = State::Arrived;
        }
        self.settle(position, error);
        let is_strong = drive.unsigned_abs() >= STRONG_DRIVE && error > LARGE_ERROR;
        if position.abs_diff(self.mark) > WAY {
            self.mark = position;
            self.in_vain = 0;
        } else if is_strong || current > self.description.current_limit {
            self.in_vain += 1;
            if self.in_vain >= STALL {
                self.state = State::Failed(Fault::Stall);
                return false;
            }
        } else {
            self.in_vain = self.in_vain.saturating_sub(1);
        }
        true
    }

    fn settle(&mut self, position: Position, error: u16) {
        let is_there = self.setpoint == self.target && error <= self.tolerance().unsigned_abs();
        if is_there && self.rests_at(position) {
            self.settled = self.settled.saturating_add(1);
        } else {
            self.settled = 0;
            self.rest = position;
        }
    }
}

#[cfg(test)]
mod tests;
