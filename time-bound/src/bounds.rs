//! The bounds of a program's interrupts, and of how long its tasks mask them.

use std::collections::BTreeSet;

use serde::Serialize;
use stack_bound::{Annotations, Found, Image};

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

/// How long an interrupt takes at most, in cycles, from its acceptance on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Interrupt {
    /// The number of its vector, from 1.
    pub vector: u8,
    /// Its name in the datasheet of the ATmega128; "?" for another MCU.
    #[serde(skip)]
    pub name: &'static str,
    /// To its end, or, if it has woken a task of a higher priority, until that task runs. Interrupts that
    /// nest in it are not counted.
    pub cycles: u64,
    /// Until interrupts are first enabled: all other interrupts wait for that.
    pub masked: u64,
    /// The longest stretch with interrupts masked after that; 0 if there is none.
    pub masked_again: u64,
    /// The longest of all these stretches that `reti` ends: after `reti` one more instruction of the
    /// interrupted code runs before the next interrupt. 0 if there is none.
    pub masked_last: u64,
}

/// How long a task keeps interrupts waiting.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Task {
    /// The name of its body.
    pub name: String,
    /// The longest stretch with interrupts masked, in cycles.
    pub masked: u64,
}

/// One iteration of a task's loop that is noted as a job.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Job {
    /// The function that has the loop.
    pub function: String,
    /// The start of the loop, in bytes of flash.
    pub address: u32,
    /// How long an iteration takes at most on its own, in cycles: with the kernel's switches in its waits,
    /// and without the code that runs meanwhile.
    pub cycles: u64,
}

/// The bounds of a program.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Bounds {
    /// By vector: the lower one is served first.
    pub interrupts: Vec<Interrupt>,
    /// By name.
    pub tasks: Vec<Task>,
    /// By address.
    pub jobs: Vec<Job>,
}

/// The bounds of the interrupt whose vector leads to `entry`.
fn interrupt(
    (vector, entry): (u8, u32),
    image: &Image,
    timer: &mut Timer,
    stretcher: &mut Stretcher,
) -> Result<Interrupt, BTreeSet<Problem>> {
    let response = response(image, true);
    let longest = timer.function(entry)?;
    let masked = stretcher.function(entry, true)?.longest;
    let whole = masked.whole.map(|whole| whole + response);
    match (longest.whole, whole.max(masked.into.map(|first| first + response))) {
        (Some(cycles), Some(first)) if longest.into.is_none() => Ok(Interrupt {
            vector,
            name: image.interrupt_name(vector),
            cycles: cycles + response,
            masked: first,
            masked_again: masked.between.max(masked.out_of).unwrap_or(0),
            masked_last: whole.max(masked.out_of).unwrap_or(0),
        }),
        _ => Err([Problem::NoEnd { vector }].into()),
    }
}

impl Bounds {
    /// The bounds of an image.
    ///
    /// # Errors
    /// Each problem that keeps any of them from being computed.
    pub fn new(image: &Image, annotations: &Annotations, notes: &Notes) -> Result<Self, Vec<Problem>> {
        let mut bounds = Bounds::default();
        let mut problems = BTreeSet::new();
        for found in [Found::Task, Found::Kernel] {
            let View { flows, facts } = View::new(image, annotations, notes, found)?;
            let mut timer = Timer::new(image, &flows, &facts);
            let mut stretcher = Stretcher::new(image, &flows, &facts);
            for served in image.interrupts() {
                match interrupt(served, image, &mut timer, &mut stretcher) {
                    Ok(interrupt) => bounds.raise(interrupt),
                    Err(more) => problems.extend(more),
                }
            }
            if found == Found::Kernel {
                continue; // a task's code never compares SP to find out whose stack it runs on
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

    /// The longest stretch, in cycles, that begins with an instruction that masks interrupts, in a task or an
    /// interrupt.
    pub fn masked_by_instructions(&self) -> u64 {
        let again = self.interrupts.iter().map(|interrupt| interrupt.masked_again);
        self.tasks.iter().map(|task| task.masked).chain(again).max().unwrap_or(0)
    }

    /// Adds an interrupt, or raises the bounds that are known of it.
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
