//! End stops: where a joint may turn.

use super::{Position, TENTH};

/// How far a joint may turn.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct EndStops {
    pub(super) lowest: Position,
    pub(super) highest: Position,
}

impl EndStops {
    /// From `lowest` to `highest`, in 0.1 degree.
    ///
    /// Panics, when it is evaluated as a constant, if a position does not hold them.
    pub const fn new(lowest: i16, highest: i16) -> Self {
        EndStops { lowest: lowest * TENTH, highest: highest * TENTH }
    }

    /// The position at `angle`, in 0.1 degree, or of the stop if that is beyond it.
    pub(super) fn position(&self, angle: i16) -> Position {
        // Between the stops, so the product fits.
        angle.min(self.highest / TENTH).max(self.lowest / TENTH).wrapping_mul(TENTH)
    }

    /// The position `by` further than `from`, or that of the stop if it is beyond it.
    pub(super) fn beyond(&self, from: Position, by: Position) -> Position {
        from.saturating_add(by).min(self.highest).max(self.lowest)
    }
}
