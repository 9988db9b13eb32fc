//! All tests of the world, in one program: it is compiled and linked once.
//! `cargo test -p superbot-world docks::` runs those of one file.

mod common;

mod backlash;
mod determinism;
mod docks;
mod formulas;
mod ground;
mod momentum;
mod motion;
mod trouble;
