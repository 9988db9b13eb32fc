//! Why a world can't go on, and what came before.

use std::fmt;

/// A world has broken.
#[derive(Clone, Debug, PartialEq)]
pub struct Trouble {
    /// When, since the beginning.
    pub seconds: f64,
    /// The module and its part; the whole model where none can be told.
    pub place: String,
    pub what: String,
    /// What the joint there did before, or of the part's module the one that turned fastest.
    pub last: Vec<Moment>,
}

/// A joint at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    pub seconds: f64,
    pub degrees: f64,
    pub degrees_per_second: f64,
    /// The mean voltage at its motor in the millisecond before.
    pub volts: f64,
}

impl fmt::Display for Trouble {
    /// In one line, without what came before.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Trouble { seconds, place, what, .. } = self;
        write!(f, "the world broke after {seconds:.3} s at {place}: {what}")
    }
}

impl std::error::Error for Trouble {}
