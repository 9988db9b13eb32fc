//! The serial port in software, as tests reach it.

/// Its number: the USARTs come first.
pub const LINE: usize = 2;

/// Cycles of a frame of ten bits at 38400 baud, as the timer counts them.
pub const FRAME: u64 = 4170;
