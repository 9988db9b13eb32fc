//! Hands out the modules of a round to threads. A thread gets the same modules each time as far as possible:
//! their data are in the cache of the core that ran them last.

use std::sync::atomic::{AtomicU64, Ordering};

/// Places in a list, a share for each worker. A worker takes the places of its own share from the front. Once
/// none is left, it takes places of other shares from the back.
pub(crate) struct Shares(Vec<Share>);

/// The places that no worker has taken yet: the upper 32 bits hold the first one, the lower 32 the end.
#[derive(Default)]
struct Share(AtomicU64);

/// Taking the first place of a share adds `FIRST`; taking the last one adds `LAST`, which is -1.
const FIRST: u64 = 1 << 32;
const LAST: u64 = u64::MAX;

impl Shares {
    /// Empty shares for `workers` workers, at least one.
    pub fn new(workers: usize) -> Self {
        Self((0..workers).map(|_| Share::default()).collect())
    }

    /// Divides the places of a list of `length` among the shares. A worker that takes a place sees all writes
    /// from before this call.
    pub fn fill(&self, length: usize) {
        for (worker, share) in self.0.iter().enumerate() {
            let [first, end] = [worker, worker + 1].map(|worker| (worker * length / self.0.len()) as u64);
            share.0.store(first << 32 | end, Ordering::Release);
        }
    }

    /// A place for `worker`, which no other worker gets; `None` if all are taken.
    pub fn take(&self, worker: usize) -> Option<usize> {
        let (before, from) = self.0.split_at_checked(worker)?;
        let (own, behind) = from.split_first()?;
        own.take(FIRST).or_else(|| behind.iter().chain(before).find_map(|share| share.take(LAST)))
    }
}

impl Share {
    fn take(&self, which: u64) -> Option<usize> {
        let ends = |share: u64| ((share >> 32) as usize, share as u32 as usize);
        let left = |share: u64| {
            let (first, end) = ends(share);
            (first < end).then(|| share.wrapping_add(which))
        };
        let share = self.0.fetch_update(Ordering::Acquire, Ordering::Relaxed, left).ok()?;
        let (first, end) = ends(share);
        Some(if which == FIRST { first } else { end - 1 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;
    use std::thread;

    #[test]
    fn a_worker_takes_its_own_from_the_front_and_then_others_from_the_back() {
        let shares = Shares::new(2);
        shares.fill(7);
        let taken: Vec<_> = [0, 1, 1, 0, 0, 0, 0, 1].map(|worker| shares.take(worker)).into();
        assert_eq!(taken, [0, 3, 4, 1, 2, 6, 5].map(Some).into_iter().chain([None]).collect::<Vec<_>>());
    }

    #[test]
    fn shares_may_be_fewer_or_more_than_places() {
        for (workers, length) in [(1, 5), (3, 0), (8, 3), (3, 100)] {
            let shares = Shares::new(workers);
            assert_eq!(shares.take(0), None);
            shares.fill(length);
            let mut taken: Vec<_> = (0..length).map(|turn| shares.take(turn % workers).unwrap()).collect();
            taken.sort();
            assert_eq!(taken, (0..length).collect::<Vec<_>>());
            assert!((0..workers).all(|worker| shares.take(worker).is_none()));
        }
    }

    #[test]
    fn at_once_nobody_takes_what_another_took() {
        let (shares, taken) = (Shares::new(4), Mutex::new(Vec::new()));
        for _ in 0..200 {
            shares.fill(50);
            thread::scope(|scope| {
                for worker in 0..4 {
                    let (shares, taken) = (&shares, &taken);
                    scope.spawn(move || {
                        while let Some(place) = shares.take(worker) {
                            taken.lock().unwrap().push(place);
                        }
                    });
                }
            });
            let mut all = std::mem::take(&mut *taken.lock().unwrap());
            all.sort();
            assert_eq!(all, (0..50).collect::<Vec<_>>());
        }
    }
}
