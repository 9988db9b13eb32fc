//! How long an interrupt waits at most from where its flag is set until it is accepted.
//!
//! Handlers do not preempt each other but where they enable interrupts, and of those that wait the one with
//! the lowest vector goes first. So an interrupt waits for what masks interrupts as its flag is set, and for
//! all with lower vectors that come until it is accepted. Behind a handler that returns by `reti` an
//! instruction more of the interrupted program runs. Where that one masks interrupts, all up to where they
//! are enabled runs, too. Behind `sei` and `ret`, by which the kernel returns, none does, and none behind
//! `reti` and `ret`, as the vectors of `board` do. A flag is a bit: what sets it again before its interrupt
//! is accepted has none of its own.

use serde::Serialize;

use crate::bounds::{Bounds, Interrupt};
use crate::costed::{BETWEEN, Costed, PATIENCE, Runs, all_of};
use crate::releases::Deadline;

/// How long an interrupt waits.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Latency {
    pub vector: u8,
    /// What masks interrupts as its flag is set, and once more behind `reti`, in cycles.
    pub blocking: u64,
    /// From its flag to its acceptance, at most; `None` if it may wait for ever.
    pub latency: Option<u64>,
    /// What it takes then to do what it has a deadline for, where there is one.
    pub takes: Option<u64>,
    /// From its flag, in cycles.
    pub deadline: Option<u64>,
}

impl Latency {
    /// Of an interrupt, and of its deadline, if it has one, with what it takes to do what is due then.
    pub(crate) fn of(
        interrupt: &Interrupt,
        costed: &[Costed],
        bounds: &Bounds,
        due: Option<(u64, &Deadline)>,
    ) -> Self {
        let (takes, deadline) = due.unzip();
        let excluded = deadline.map_or(&[][..], |deadline| &deadline.excludes);
        let (blocking, latency) = Self::waits(interrupt, excluded, costed, bounds);
        let deadline = deadline.map(|deadline| deadline.within);
        Latency { vector: interrupt.vector, blocking, latency, takes, deadline }
    }

    /// What is left until the deadline, in cycles; less than none where the bound is beyond it.
    pub fn slack(&self) -> Option<i64> {
        let done = self.latency? + self.takes?;
        Some(self.deadline?.cast_signed() - done.cast_signed())
    }

    fn waits(
        interrupt: &Interrupt,
        excluded: &[u8],
        costed: &[Costed],
        bounds: &Bounds,
    ) -> (u64, Option<u64>) {
        let vector = interrupt.vector;
        let longest = |masks: fn(&Interrupt) -> u64| {
            let not_before = bounds.interrupts.iter().filter(|other| other.vector >= vector);
            not_before.map(|other| longest_run(other.vector, costed).min(masks(other))).max().unwrap_or(0)
        };
        let by_instructions = bounds.masked_by_instructions();
        let behind_return = match longest(|other| other.masked_last) {
            0 => 0,
            last => last + BETWEEN + by_instructions,
        };
        let blocking = longest(|other| other.masked).max(by_instructions).max(behind_return) + BETWEEN;
        let mut latency = blocking;
        while latency < PATIENCE {
            // One that comes as it is about to be accepted still goes before.
            let goes_before = |other: u8| other < vector && !excluded.contains(&other);
            let before =
                |one: &Costed| all_of(one.times_without_tasks(latency + 1), one.interrupts_of(goes_before));
            let next = blocking + costed.iter().map(before).sum::<u64>();
            if next <= latency {
                return (blocking, Some(latency));
            }
            latency = next;
        }
        (blocking, None)
    }
}

/// The longest run of a vector among those that come; for ever if none is said to.
fn longest_run(vector: u8, costed: &[Costed]) -> u64 {
    let runs = costed.iter().flat_map(|one| one.runs.iter().flatten());
    runs.filter(|run| run.vector == Some(vector)).map(Runs::longest).max().unwrap_or(u64::MAX)
}
