//! The joints: position control each millisecond (paper, section 5).
//!
//! | file | what |
//! |---|---|
//! | [`potentiometer`] | from the converter's reading to a position |
//! | [`pid`] | the controller |
//! | [`end_stops`] | how far a joint may turn |
//! | [`joint`] | a joint: speed limit, current limit, what may go wrong |
//! | [`joints`] | the joints of one MCU: when they are controlled, looked at or left alone |
//! | [`task`] | the task that drives these |
//!
//! All in 16-bit integers, with shifts for divisions. Positions are in 1/160 degree, a sixteenth of the unit
//! of [`TENTH`]: fine enough to lose nothing of a reading, and 200 degrees to either side fit 16 bits.

pub mod end_stops;
pub mod joint;
pub mod joints;
pub mod pid;
pub mod potentiometer;
pub mod task;

/// One of a module's three joints, each driven by a motor. The numbers are those of the lab's own simulator.
#[repr(u8)]
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub enum Axis {
    /// Motor0, in the half with the dock Front.
    Front = 0,
    /// Motor1, between the halves.
    Roll = 1,
    /// Motor2, in the half with the dock Back.
    Back = 2,
}

impl Axis {
    /// All joints, in the order of their indices.
    pub const ALL: [Axis; 3] = [Axis::Front, Axis::Roll, Axis::Back];

    /// The joint with this index; `None` above 2.
    pub const fn from_index(index: u8) -> Option<Axis> {
        match index {
            0 => Some(Axis::Front),
            1 => Some(Axis::Roll),
            2 => Some(Axis::Back),
            _ => None,
        }
    }

    /// The joint's number, 0..=2.
    pub const fn index(self) -> u8 {
        self as u8
    }
}

/// A position, in 1/160 degree.
pub type Position = i16;

/// 0.1 degree as a [`Position`].
pub const TENTH: Position = 16;

/// A degree as a [`Position`].
pub const DEGREE: Position = 10 * TENTH;

/// A position in 0.1 degree, to the nearest.
pub fn to_angle(position: Position) -> i16 {
    position.saturating_add(TENTH / 2) >> TENTH.ilog2()
}

/// The drive that is full duty towards positive angles; its negative is full duty the other way.
pub const FULL_DRIVE: i16 = 400;
