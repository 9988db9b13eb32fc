//! Counts how often a run executes instructions whose number is limited by a note.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use simavr_harness::{Debugger, Mcu};
use time_bound::Limit;

use crate::MILLISECOND;

/// How long a program starts after a reset, in cycles: until then its tasks prepare, which no job does again.
const START_UP: u64 = 100 * MILLISECOND;

/// The most times that were seen, in the order of the limits; shared with the MCU that counts.
#[derive(Clone)]
pub struct Times(Arc<Mutex<Vec<u64>>>);

impl Times {
    /// Counts from now on how often `mcu` executes what is limited, but not while it starts. It runs slower,
    /// and behaves the same.
    pub fn count(mcu: &mut Mcu, limits: &[Limit]) -> Self {
        let most = Self(Arc::new(Mutex::new(vec![0; limits.len()])));
        let words = mcu.image().flash().len() / 2;
        let mut of_word = vec![Vec::new(); words];
        for (number, limit) in limits.iter().enumerate() {
            limit.begins.iter().for_each(|&at| of_word[at as usize / 2].push(Role::Begins(number)));
            limit.counted.iter().for_each(|&at| of_word[at as usize / 2].push(Role::Counts(number)));
        }
        mcu.set_debugger(Box::new(Counter {
            resets: mcu.resets(),
            since: mcu.cycle(),
            of_word,
            under_way: vec![BTreeMap::new(); limits.len()],
            most: most.clone(),
        }));
        most
    }

    /// The most times of each so far; 0 for what was never executed.
    pub fn most(&self) -> Vec<u64> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// What an instruction says about the limit of this number.
#[derive(Clone, Copy)]
enum Role {
    /// The count begins anew.
    Begins(usize),
    Counts(usize),
}

struct Counter {
    resets: u64,
    /// The cycle of the last reset.
    since: u64,
    /// By address in flash, in words.
    of_word: Vec<Vec<Role>>,
    /// The counts so far, by limit and stack pointer: several tasks may be in a loop. All of them are dropped
    /// where any begins anew, so a count may be too small, and is never too large.
    under_way: Vec<BTreeMap<u16, u64>>,
    most: Times,
}

impl Debugger for Counter {
    fn before_instruction(&mut self, mcu: &mut Mcu) {
        if self.resets != mcu.resets() {
            (self.resets, self.since) = (mcu.resets(), mcu.cycle());
            self.under_way.iter_mut().for_each(BTreeMap::clear);
        }
        if mcu.cycle() - self.since < START_UP {
            return;
        }
        let Some(roles) = self.of_word.get(mcu.pc() as usize / 2) else { return };
        for &role in roles {
            match role {
                Role::Begins(number) => self.under_way[number].clear(),
                Role::Counts(number) => {
                    let times = self.under_way[number].entry(mcu.stack_pointer()).or_default();
                    *times += 1;
                    let mut most = self.most.0.lock().unwrap_or_else(PoisonError::into_inner);
                    most[number] = most[number].max(*times);
                }
            }
        }
    }
}
