//! A canary for the AVR's compiler: computations with one right result on any machine.
//!
//! The image of this crate runs them on the AVR. The test `canary` of `tests/simavr` runs them on the host,
//! and compares. Each check computes with numbers that the compiler can't foresee, and yields a digest.
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
    /// Runs `trial` in each round. It is a function of its own, so that none gets too large for its jumps.
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
