//! Two ends of a link over a line that loses, corrupts, duplicates, delays and reflects, and ends
//! that are reset: every message arrives exactly once and in order, or its sender is told.

mod exhaustive;
mod random;
