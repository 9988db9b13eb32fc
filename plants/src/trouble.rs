//! Why a world can't go on, and its state before that.

use std::fmt;

/// A world has broken.
#[derive(Clone, Debug, PartialEq)]
pub struct Trouble {
    /// The time since the beginning.
    pub seconds: f64,
    /// The module and its part, or the whole model if none can be told.
    pub place: String,
    pub what: String,
    /// The last moments of the joint there, or else of the joint of the part's module that turned fastest.
    pub last: Vec<Moment>,
}

/// The state of a joint at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    pub seconds: f64,
    pub degrees: f64,
    pub degrees_per_second: f64,
    /// The mean voltage at its motor in the millisecond before.
    pub volts: f64,
}

impl fmt::Display for Trouble {
    /// In one line, without the last moments.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Trouble { seconds, place, what, .. } = self;
        write!(f, "the world broke after {seconds:.3} s at {place}: {what}")
    }
}

impl std::error::Error for Trouble {}
