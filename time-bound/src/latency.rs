//! How long an interrupt waits at most from the setting of its flag to its acceptance.
//!
//! Handlers preempt each other only where they enable interrupts, and of the pending interrupts the one with
//! the lowest vector is accepted first. So an interrupt waits for the code that masks interrupts as its flag
//! is set, and for all interrupts with lower vectors that come until it is accepted. After a handler that
//! returns by `reti` one more instruction of the interrupted program runs. If that instruction masks
//! interrupts, all code runs up to where they are enabled. The kernel returns by `sei` and `ret`, and the
//! vectors of `board` by `reti` to a `ret`: after these no such instruction runs. A flag is one bit: an event
//! that sets it again before its interrupt is accepted causes no second interrupt.

use serde::Serialize;

use crate::bounds::{Bounds, Interrupt};
use crate::costed::{BETWEEN, Costed, PATIENCE, Runs, all_of};
use crate::releases::Deadline;

/// How long an interrupt waits.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Latency {
    pub vector: u8,
    /// Its name in the datasheet of the ATmega128; "?" for another MCU.
    #[serde(skip)]
    pub name: &'static str,
    /// How long interrupts are masked as its flag is set, and once more after `reti`, in cycles.
    pub blocking: u64,
    /// From its flag to its acceptance, at most, in cycles; `None` if it may wait for ever.
    pub latency: Option<u64>,
    /// How long the work with the deadline takes from then on, if there is a deadline, in cycles.
    pub takes: Option<u64>,
    /// From its flag, in cycles.
    pub deadline: Option<u64>,
}

impl Latency {
    /// The latency of an interrupt. `due` has its deadline, if it has one, and how long the work takes that
    /// is due then.
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
        let &Interrupt { vector, name, .. } = interrupt;
        Latency { vector, name, blocking, latency, takes, deadline }
    }

    /// The time left until the deadline, in cycles; negative if the bound exceeds the deadline.
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
            // An interrupt with a lower vector that comes just before the acceptance still goes first.
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

/// The longest listed run of a vector; for ever if none is listed.
fn longest_run(vector: u8, costed: &[Costed]) -> u64 {
    let runs = costed.iter().flat_map(|one| one.runs.iter().flatten());
    runs.filter(|run| run.vector == Some(vector)).map(Runs::longest).max().unwrap_or(u64::MAX)
}
