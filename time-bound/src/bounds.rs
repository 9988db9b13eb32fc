//! The bounds of a program's interrupts, and of what its tasks keep them waiting for.

use std::collections::BTreeSet;

use serde::Serialize;
use stack_bound::{Annotations, Found, Image, vectors};

use crate::execution::Timer;
use crate::facts::View;
use crate::masked::Stretcher;
use crate::notes::Notes;
use crate::problem::Problem;

/// From the acceptance of an interrupt to the first instruction of its handler, in cycles: the response, of a
/// core that sleeps or is awake, and the jump in the table of vectors (datasheets of ATmega128 and
/// ATmega2560, "Interrupt Response Time").
pub fn response(image: &Image, is_asleep: bool) -> u64 {
    let (jump, more) = (3, u64::from(image.return_address_bytes() == 3));
    if is_asleep { jump + 8 + 2 * more } else { jump + 4 + more }
}

/// What an interrupt takes at most, in cycles, from its acceptance on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Interrupt {
    /// The number of its vector, from 1.
    pub vector: u8,
    /// To its end; and where it has woken a task of a higher priority, until that runs. What nests in it is
    /// not counted.
    pub cycles: u64,
    /// Until interrupts are enabled first: all others wait for that.
    pub masked: u64,
    /// The longest stretch with interrupts masked after that; 0 if there is none.
    pub masked_again: u64,
    /// The longest of all these that `reti` ends: behind that no interrupt comes before an instruction more
    /// of what was interrupted. 0 if there is none.
    pub masked_last: u64,
}

impl Interrupt {
    /// What the datasheet calls it.
    pub fn name(&self) -> &'static str {
        vectors::name(self.vector).unwrap_or("?")
    }
}

/// What a task keeps interrupts waiting for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Task {
    /// The name of its body.
    pub name: String,
    /// The longest stretch with interrupts masked, in cycles.
    pub masked: u64,
}

/// A turn of a task's loop that is noted as a job.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Job {
    /// The function that has the loop.
    pub function: String,
    /// Where the loop begins, in bytes of flash.
    pub address: u32,
    /// What a turn takes at most on its own, in cycles: with the kernel's switches, which its waits make, and
    /// without what runs meanwhile.
    pub cycles: u64,
}

/// The bounds of a program.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Bounds {
    /// By vector: the lower goes first.
    pub interrupts: Vec<Interrupt>,
    /// By name.
    pub tasks: Vec<Task>,
    /// By address.
    pub jobs: Vec<Job>,
}

/// What the interrupt takes whose vector leads there.
fn interrupt(
    (vector, entry): (u8, u32),
    response: u64,
    timer: &mut Timer,
    stretcher: &mut Stretcher,
) -> Result<Interrupt, BTreeSet<Problem>> {
    let longest = timer.function(entry)?;
    let masked = stretcher.function(entry, true)?.longest;
    let whole = masked.whole.map(|whole| whole + response);
    match (longest.whole, whole.max(masked.into.map(|first| first + response))) {
        (Some(cycles), Some(first)) if longest.into.is_none() => Ok(Interrupt {
            vector,
            cycles: cycles + response,
            masked: first,
            masked_again: masked.between.max(masked.out_of).unwrap_or(0),
            masked_last: whole.max(masked.out_of).unwrap_or(0),
        }),
        _ => Err([Problem::NoEnd { vector }].into()),
    }
}

impl Bounds {
    /// Of an image.
    ///
    /// # Errors
    /// All that keeps any of them from being computed.
    pub fn new(image: &Image, annotations: &Annotations, notes: &Notes) -> Result<Self, Vec<Problem>> {
        let mut bounds = Bounds::default();
        let mut problems = BTreeSet::new();
        for found in [Found::Task, Found::Kernel] {
            let View { flows, facts } = View::new(image, annotations, notes, found)?;
            let mut timer = Timer::new(image, &flows, &facts);
            let mut stretcher = Stretcher::new(image, &flows, &facts);
            for served in image.interrupts() {
                match interrupt(served, response(image, true), &mut timer, &mut stretcher) {
                    Ok(interrupt) => bounds.raise(interrupt),
                    Err(more) => problems.extend(more),
                }
            }
            if found == Found::Kernel {
                continue; // of tasks no instruction asks whose stack it has found
            }
            for entry in facts.with_jobs(&flows) {
                problems.extend(timer.function(entry).err().into_iter().flatten());
            }
            bounds.jobs.extend(timer.jobs.iter().map(|(&address, &cycles)| Job {
                function: image.name(address).to_owned(),
                address,
                cycles,
            }));
            for entry in image.task_entries() {
                match stretcher.function(entry, false) {
                    Ok(stretches) => bounds.tasks.push(Task {
                        name: image.body(entry).to_owned(),
                        masked: stretches.longest.between.unwrap_or(0),
                    }),
                    Err(more) => problems.extend(more),
                }
            }
        }
        bounds.interrupts.sort_by_key(|interrupt| interrupt.vector);
        bounds.tasks.sort_by(|one, other| one.name.cmp(&other.name));
        if problems.is_empty() { Ok(bounds) } else { Err(problems.into_iter().collect()) }
    }

    /// The longest stretch, in cycles, for which an instruction masks interrupts, in a task or an interrupt.
    pub fn masked_by_instructions(&self) -> u64 {
        let again = self.interrupts.iter().map(|interrupt| interrupt.masked_again);
        self.tasks.iter().map(|task| task.masked).chain(again).max().unwrap_or(0)
    }

    /// Adds an interrupt, or raises what is there of it.
    fn raise(&mut self, interrupt: Interrupt) {
        match self.interrupts.iter_mut().find(|other| other.vector == interrupt.vector) {
            Some(known) => {
                known.cycles = known.cycles.max(interrupt.cycles);
                known.masked = known.masked.max(interrupt.masked);
                known.masked_again = known.masked_again.max(interrupt.masked_again);
                known.masked_last = known.masked_last.max(interrupt.masked_last);
            }
            None => self.interrupts.push(interrupt),
        }
    }
}
