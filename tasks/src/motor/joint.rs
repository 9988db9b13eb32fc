//! One joint: its target, its limits, and what may go wrong with it.

use super::end_stops::EndStops;
use super::pid::Pid;
use super::{DEGREE, FULL_DRIVE, Position, TENTH};
use crate::superbot::{JOINT_CURRENT_LIMIT, POTENTIOMETER};

/// A joint's position is known no closer than this: half a count of the converter.
const TOLERANCE: Position = POTENTIOMETER.resolution() / 2;

/// The setpoint waits for a joint that lags further behind than this.
const LARGEST_LAG: u16 = 5 * DEGREE as u16;

/// No joint turns further than this in a period: a working potentiometer gives no such reading.
const LARGEST_STEP: u16 = 3 * DEGREE as u16;

/// Readings in a row that must be bad before the potentiometer counts as broken. Meanwhile the motor is off.
const BAD_READINGS: u8 = 3;

/// The drive that a speed takes is the speed, in 1/256 units in a period, shifted right by this: a free joint
/// turns at 80 degrees per second with full drive.
const DRIVE_OF_SPEED: u32 = 3;

/// Within this of its target a joint has arrived.
const ARRIVED: u16 = 3 * TENTH as u16;

/// A joint that moves less than this makes no way.
const WAY: u16 = DEGREE as u16;

/// A joint further than this from its target, and from its setpoint, is meant to move.
const LARGE_ERROR: u16 = 2 * DEGREE as u16;

/// With this much drive a free joint moves.
const STRONG_DRIVE: u16 = FULL_DRIVE as u16 / 4;

/// Once in so many periods the effect of the drives is reviewed: a power of two.
const REVIEW: u8 = 8;

/// So many reviews without way, while the drive is strong far from the target or the current above its
/// limit, make a stall: 248 ms. Near its target a joint that is held pushes on, with less than that current.
const STALL: u8 = 31;

/// A joint that is held off its target gives way after so many reviews in a row without way, of which one in
/// 32 counts: 10 s. From then on it pushes with little more than [`STRONG_DRIVE`].
const HELD: u8 = 40;

/// The joint is at rest after so many reviews in a row that find it at its target, and where the one before
/// found it: 96 ms.
const SETTLED: u8 = 12;

/// A joint at rest is at rest no longer after so many looks in a row that find it off its target: 256 ms.
const CREPT: u8 = 8;

/// The state of a joint. The number of each is its code in a report.
#[repr(u8)]
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub enum State {
    /// The motor is off.
    Off = 0,
    /// On its way to the target.
    Moving = 1,
    /// At the target, and kept there.
    Arrived = 2,
    /// The motor is off until there is a new target: the potentiometer reads what no working one does, out of
    /// range, or further than the joint can have turned.
    BrokenPotentiometer = 3,
    /// The motor is off until there is a new target: it drove, and the joint did not move.
    Stalled = 4,
}

impl State {
    /// The state's code in a report.
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// The state with this code; `None` above 4.
    pub const fn from_code(code: u8) -> Option<State> {
        match code {
            0 => Some(State::Off),
            1 => Some(State::Moving),
            2 => Some(State::Arrived),
            3 => Some(State::BrokenPotentiometer),
            4 => Some(State::Stalled),
            _ => None,
        }
    }
}

/// The converter's readings of a joint, 0 to 1023 each.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Reading {
    pub potentiometer: u16,
    /// The motor's current.
    pub current: u16,
}

/// One joint, to be stepped each millisecond.
pub struct Joint {
    stops: EndStops,
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
    /// The last good reading's position; `None` before the first, and once the potentiometer gives none.
    position: Option<Position>,
    bad_readings: u8,
    /// Counts periods, for the reviews.
    period: u8,
    /// Where the joint was when it last made way, and the reviews in vain since.
    mark: Position,
    in_vain: u8,
    /// The reviews in a row, of which one in 32 counts, that found it held off the target that its setpoint
    /// has come to.
    held: u8,
    /// Where the joint has come to rest, and the reviews that found it there.
    rest: Position,
    settled: u8,
    /// The looks in a row that have found the joint off its target.
    off: u8,
}

impl Joint {
    /// A joint whose motor is off.
    pub const fn new(stops: EndStops) -> Self {
        Joint {
            stops,
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
            held: 0,
            rest: 0,
            settled: 0,
            off: 0,
        }
    }

    /// Turns the joint to `angle`, in 0.1 degree, at no more than `speed`, in degrees per second. An angle
    /// beyond an end stop counts as that stop.
    pub fn turn_to(&mut self, angle: i16, speed: u8) {
        self.turn(self.stops.position(angle), speed);
    }

    /// Turns the joint as [`turn_to`](Self::turn_to), but by an angle from where the last reading found it.
    /// Where there is none its potentiometer counts as broken.
    pub fn turn_by(&mut self, by: i16, speed: u8) {
        match self.position {
            Some(at) => self.turn(self.stops.beyond(at, by.saturating_mul(TENTH)), speed),
            None => self.state = State::BrokenPotentiometer,
        }
    }

    #[inline(never)] // called in several places
    fn turn(&mut self, target: Position, speed: u8) {
        self.target = target;
        self.settled = 0;
        // 41/256 is a degree per second in units per millisecond: 0.16.
        self.speed = u16::from(speed) * 41;
        match self.state {
            State::Moving | State::Arrived => self.state = State::Moving,
            State::Off | State::BrokenPotentiometer | State::Stalled => {
                self.state = State::Moving;
                self.bad_readings = 0;
                self.in_vain = 0;
                self.ceiling = FULL_DRIVE;
                // The joint begins where the next reading finds it.
                self.position = None;
            }
        }
    }

    /// Switches the motor off. The gear holds the joint, more or less.
    pub fn release(&mut self) {
        self.state = State::Off;
    }

    /// The joint's state.
    pub fn state(&self) -> State {
        self.state
    }

    /// Where the joint is, as far as its potentiometer tells.
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

    /// Looks at a joint at rest. One that has been moved, or can't be measured, is at rest no longer. Nor is
    /// one that a load has moved by no more than the converter's noise, if it stays there.
    pub fn watch(&mut self, reading: Reading) {
        let position = POTENTIOMETER.position(reading.potentiometer);
        let Some(at) = position.filter(|position| self.rests_at(*position)) else {
            self.settled = 0;
            return;
        };
        self.off = if self.target.abs_diff(at) <= TOLERANCE.unsigned_abs() { 0 } else { self.off + 1 };
        if self.off >= CREPT {
            (self.off, self.settled) = (0, 0);
        }
    }

    /// The first reading after a rest. Since the last one the joint may have turned further than in a period,
    /// and one that is off by any angle.
    #[inline(never)] // seldom called, it would cost its task registers
    pub fn resume(&mut self, reading: Reading) {
        let last = self.position.filter(|_| self.is_driven());
        self.position = POTENTIOMETER.position(reading.potentiometer).or(last);
    }

    /// One period. Returns the drive, from -[`FULL_DRIVE`] to [`FULL_DRIVE`].
    pub fn step(&mut self, reading: Reading) -> i16 {
        let Some(position) = self.plausible(reading.potentiometer) else {
            self.bad_readings = self.bad_readings.saturating_add(1);
            if self.bad_readings >= BAD_READINGS {
                self.position = None;
                if self.is_driven() {
                    self.state = State::BrokenPotentiometer;
                }
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
        let sought = self.pid.step(self.setpoint, position, TOLERANCE, feed_forward, self.ceiling);
        let drive = self.stop_at_ends(position, sought);
        self.period = self.period.wrapping_add(1);
        if self.period & (REVIEW - 1) == 0 && !self.review(position, drive, reading.current) {
            return 0;
        }
        drive
    }

    /// The position, if it can be that of the joint. A joint that is off may have been turned while it was
    /// not measured, so it can have any.
    fn plausible(&self, reading: u16) -> Option<Position> {
        let position = POTENTIOMETER.position(reading)?;
        match self.position {
            Some(last) if position.abs_diff(last) > LARGEST_STEP && self.is_driven() => None,
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

    /// Whether a position is where the joint has come to rest, but for the converter's noise.
    fn rests_at(&self, position: Position) -> bool {
        self.rest.abs_diff(position) <= POTENTIOMETER.resolution().unsigned_abs()
    }

    /// Moves the setpoint towards the target. Returns the drive that its motion takes.
    fn advance_setpoint(&mut self, position: Position) -> i16 {
        let left = self.target.abs_diff(self.setpoint);
        if left == 0 {
            return 0;
        }
        self.held = 0;
        let drive = (self.speed >> DRIVE_OF_SPEED).min(FULL_DRIVE as u16) as i16;
        let is_upward = self.setpoint < self.target;
        let is_ahead = (self.setpoint < position) == is_upward;
        if is_ahead || self.setpoint.abs_diff(position) <= LARGEST_LAG {
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
        if current > JOINT_CURRENT_LIMIT {
            self.ceiling -= self.ceiling >> 4;
        } else if self.ceiling < FULL_DRIVE {
            self.ceiling += 1;
        }
    }

    /// `drive`, or 0 where it would drive beyond an end stop.
    fn stop_at_ends(&self, position: Position, drive: i16) -> i16 {
        let EndStops { lowest, highest } = self.stops;
        if (position >= highest && drive > 0) || (position <= lowest && drive < 0) { 0 } else { drive }
    }

    /// Reviews the effect of the drives. Returns whether the motor may stay on.
    #[inline(never)] // seldom called, it would cost the rest its registers
    fn review(&mut self, position: Position, drive: i16, current: u16) -> bool {
        let error = self.target.abs_diff(position);
        if self.setpoint == self.target && error <= ARRIVED {
            self.state = State::Arrived;
        }
        self.settle(position, error);
        let is_strong = drive.unsigned_abs() >= STRONG_DRIVE;
        // One that is slow by order may make less way, but keeps to its setpoint.
        let lags = error.min(self.setpoint.abs_diff(position)) > LARGE_ERROR;
        if position.abs_diff(self.mark) > WAY {
            self.mark = position;
            (self.in_vain, self.held) = (0, 0);
        } else if is_strong && lags || current > JOINT_CURRENT_LIMIT {
            self.in_vain += 1;
            if self.in_vain >= STALL {
                self.state = State::Stalled;
                return false;
            }
        } else {
            self.in_vain = self.in_vain.saturating_sub(1);
        }
        self.give_way(error, is_strong);
        true
    }

    fn give_way(&mut self, error: u16, is_strong: bool) {
        // One that is held a count off has arrived, but its drive grows all the same.
        if error < TOLERANCE.unsigned_abs() {
            self.held = 0;
        } else if self.held >= HELD {
            self.ceiling = STRONG_DRIVE as i16;
        } else if !is_strong {
            self.held = 0;
        } else if self.period == 0 {
            self.held += 1;
        }
    }

    fn settle(&mut self, position: Position, error: u16) {
        let is_there = self.setpoint == self.target && error <= TOLERANCE.unsigned_abs();
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
