//! A canary for the AVR's compiler: computations with one right result, whatever machine does them.
//!
//! The image beside this runs them on the AVR, the test `canary` of `tests/simavr` on the host, and compares.
//! Each check computes with numbers that the compiler can't foresee, and comes down to a digest.
#![no_std]

mod control;
mod digest;
mod integers;
mod memory;
mod random;
mod shifts;

use core::hash::{Hash, Hasher};

use digest::Digest;
use random::Random;

/// How often each check computes, with other numbers each time.
const ROUNDS: u8 = 24;

/// Runs all checks in order, and gives `record` the name and the digest of each.
pub fn run(record: impl FnMut(&'static str, u32)) {
    let mut checks = Checks { record };
    integers::run(&mut checks);
    shifts::run(&mut checks);
    control::run(&mut checks);
    memory::run(&mut checks);
}

struct Checks<R> {
    record: R,
}

impl<R: FnMut(&'static str, u32)> Checks<R> {
    /// Runs `trial` in each round. By itself, so that no function gets too large to jump through.
    #[inline(never)]
    fn check<T: Hash>(&mut self, name: &'static str, trial: impl Fn(&mut Random) -> T) {
        let mut random = Random::new();
        let mut digest = Digest::new();
        for _ in 0..ROUNDS {
            trial(&mut random).hash(&mut digest);
        }
        (self.record)(name, digest.finish() as u32);
    }
}
