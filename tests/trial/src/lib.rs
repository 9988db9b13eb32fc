//! What `./x bench concurrency` adds to a module's behaviours: two that have something to do every 7 and
//! every 11 ms, one that answers an edge at the pin of the external interrupt, and one that computes now and
//! then, for a time that nobody knows beforehand.
//!
//! The firmware runs them as tasks, the sequential program in its loop. Both say by marks what they do.

#![no_std]

use kernel::{MaskedCell, Ticks};

/// The two periods, in ticks of 1 ms. They have no common divisor.
pub const SEVEN: Ticks = 7;
pub const ELEVEN: Ticks = 11;

/// How often the one that computes does so, in ticks of 1 ms.
pub const COMPUTES_EVERY: Ticks = 200;

/// A piece of what it computes, in cycles: 0.1 ms.
pub const PIECE: u16 = 1600;

/// [`TRIAL_LENGTH`] of what has no end.
pub const ENDLESS: u16 = u16::MAX;

/// How long it computes, in pieces. The bench sets it, and reads nothing of it.
#[unsafe(no_mangle)]
pub static TRIAL_LENGTH: MaskedCell<u16> = MaskedCell::new(0);

/// Whether the loop computes a piece in each turn, and is to look at all the rest between two of them.
/// Likewise.
#[unsafe(no_mangle)]
pub static TRIAL_IS_CUT: MaskedCell<bool> = MaskedCell::new(false);

/// The marks, none of which is a behaviour's.
pub mod mark {
    /// One of the two periods has passed.
    pub const SEVEN: u8 = 1;
    pub const ELEVEN: u8 = 2;
    /// The edge was answered.
    pub const EDGE: u8 = 3;
    /// Computing begins, and ends.
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
