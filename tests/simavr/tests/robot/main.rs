//! What the robot does by its images in simavr, in one program. It needs no image of the tests, so it may run
//! while those are still being built.
//! `cargo test -p superbot-tests-simavr --test robot ring::` runs the tests of one file.

mod agreement;
mod concurrency;
mod engines;
mod first_behaviour;
mod images;
mod legs;
mod light;
mod memory;
mod motion;
mod open_dock;
mod period;
mod reconfiguration;
mod response;
mod ring;
mod robot;
mod rules;
mod standing;
mod turned;
mod watchdog;
mod world;
