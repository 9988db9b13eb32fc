//! The docking motors (not in the paper: "being developed"), and the way of one dock to another.
//!
//! | file | what |
//! |---|---|
//! | [`latch`] | a docking motor: latch and release, by end switches |
//! | [`guidance`] | to find the neighbour's dock by infrared proximity |

pub mod guidance;
pub mod latch;
