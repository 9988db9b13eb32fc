//! The joints: position control each millisecond (paper, section 5).
//!
//! | file | what |
//! |---|---|
//! | [`potentiometer`] | from the converter's reading to a position |
//! | [`pid`] | the controller |
//! | [`joint`] | a joint: speed limit, current limit, end stops, what may go wrong |
//!
//! All in 16-bit integers, with shifts for divisions. Positions are in 1/160 degree, a sixteenth of the unit of
//! [`TENTH`]: fine enough to lose nothing of a reading, and 200 degrees to either side fit 16 bits.

pub mod joint;
pub mod pid;
pub mod potentiometer;

/// A position, in 1/160 degree.
pub type Position = i16;

/// 0.1 degree as a [`Position`].
pub const TENTH: Position = 16;

/// A degree as a [`Position`].
pub const DEGREE: Position = 10 * TENTH;

/// The drive that is full duty towards positive angles; its negative is full duty the other way.
pub const FULL_DRIVE: i16 = 400;
