//! The behaviours that `./x bench concurrency` adds to a module: two that act every 7 and every 11 ms, one
//! that answers an edge at the pin of the external interrupt, and one that computes now and then, for a time
//! that is not known beforehand.
//!
//! The firmware runs them as tasks, the sequential program runs them in its loop. Both report by marks.

#![no_std]

use kernel::{MaskedCell, Ticks};

/// The two periods, in ticks of 1 ms. They have no common divisor.
pub const SEVEN: Ticks = 7;
pub const ELEVEN: Ticks = 11;

/// The period of the behaviour that computes, in ticks of 1 ms.
pub const COMPUTES_EVERY: Ticks = 200;

/// A piece of its computation, in cycles: 0.1 ms.
pub const PIECE: u16 = 1600;

/// The [`TRIAL_LENGTH`] of a computation without end.
pub const ENDLESS: u16 = u16::MAX;

/// How long it computes, in pieces. The bench sets this, and does not read it.
#[unsafe(no_mangle)]
pub static TRIAL_LENGTH: MaskedCell<u16> = MaskedCell::new(0);

/// Whether the loop computes one piece in each turn, so that it checks all other parts between two pieces.
/// The bench sets this, too.
#[unsafe(no_mangle)]
pub static TRIAL_IS_CUT: MaskedCell<bool> = MaskedCell::new(false);

/// The marks. The behaviours of the firmware use none of these values.
pub mod mark {
    /// One of the two periods has passed.
    pub const SEVEN: u8 = 1;
    pub const ELEVEN: u8 = 2;
    /// The edge was answered.
    pub const EDGE: u8 = 3;
    /// The begin and the end of computing.
    pub const BEGINS: u8 = 4;
    pub const ENDS: u8 = 5;
}

/// Computes so many pieces, each by a call of `piece`.
#[inline(always)]
pub fn compute(length: u16, mut piece: impl FnMut()) {
    let mut left = length;
    while left > 0 {
        piece();
        if length != ENDLESS {
            left -= 1;
        }
    }
}
