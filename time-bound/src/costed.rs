//! Events with what each of them costs.

use std::collections::BTreeMap;

use crate::bounds::Bounds;
use crate::costs::Costs;
use crate::problem::Problem;
use crate::releases::{Event, Releases, Run};

/// Longer than this, in cycles, nobody looks: the CPU is taken to be busy for ever. 10 s.
pub const PATIENCE: u64 = 160_000_000;

/// Behind `reti`, and behind what enables interrupts, the program executes one instruction, of 4 cycles at
/// most, before the next interrupt.
pub const BETWEEN: u64 = 4;

/// Runs of an interrupt.
pub struct Runs {
    pub vector: Option<u8>,
    times: u64,
    /// All of them together.
    cycles: u64,
    /// What the interrupted program executes behind each of them, in cycles, though an interrupt is pending.
    behind: u64,
}

impl Runs {
    fn of(run: &Run, costs: &Costs, bounds: &Bounds) -> Result<Self, Vec<Problem>> {
        let behind = run.vector.map_or(0, |vector| behind(vector, bounds));
        Ok(Runs { vector: run.vector, times: run.times.into(), cycles: costs.of(run)?, behind })
    }

    fn with_behind(&self) -> u64 {
        self.cycles + self.times * self.behind
    }

    /// One of them.
    pub fn longest(&self) -> u64 {
        self.cycles / self.times.max(1)
    }
}

/// An event with what it costs: of interrupts, and of each task by priority.
pub struct Costed<'a> {
    pub event: &'a Event,
    /// The priority of the task without which no more of them come.
    needed: Option<u8>,
    /// The interrupts that it has run, or others instead.
    pub runs: [Vec<Runs>; 2],
    pub tasks: BTreeMap<u8, u64>,
}

impl<'a> Costed<'a> {
    /// Of an event.
    ///
    /// # Errors
    /// All that keeps a run from having a bound, and names of tasks that are not listed.
    pub fn of(
        event: &'a Event,
        releases: &Releases,
        costs: &Costs,
        bounds: &Bounds,
    ) -> Result<Self, Vec<Problem>> {
        let named = |name: &String| {
            let task = releases.tasks.iter().find(|task| task.name == *name);
            let missing = || Problem::NoTask { event: event.name.clone(), task: name.clone() };
            task.map(|task| task.priority).ok_or_else(|| vec![missing()])
        };
        let needed = event.needs.as_ref().map(named).transpose()?;
        let mut runs = [Vec::new(), Vec::new()];
        let mut tasks = BTreeMap::new();
        for run in &event.runs {
            match &run.by {
                Some(task) => *tasks.entry(named(task)?).or_default() += costs.of(run)?,
                None => runs[0].push(Runs::of(run, costs, bounds)?),
            }
        }
        for run in &event.or {
            runs[1].push(Runs::of(run, costs, bounds)?);
        }
        Ok(Costed { event, needed, runs, tasks })
    }

    /// What it takes of interrupts.
    pub fn interrupts(&self) -> u64 {
        self.most(|_| true, |run| run.cycles)
    }

    /// What it takes of interrupts with such vectors, with what the program executes behind each.
    pub fn interrupts_of(&self, is_such: impl Fn(u8) -> bool) -> u64 {
        self.most(|run| run.vector.is_some_and(&is_such), Runs::with_behind)
    }

    fn most(&self, counts: impl Fn(&&Runs) -> bool, cycles: impl Fn(&Runs) -> u64) -> u64 {
        let of = |runs: &[Runs]| runs.iter().filter(&counts).map(&cycles).sum::<u64>();
        let [runs, instead] = &self.runs;
        of(runs).max(of(instead))
    }

    /// What it takes of interrupts, with what a lower task executes behind each, and of tasks that go before
    /// a task of this priority, or beside it.
    pub fn cycles(&self, priority: u8) -> u64 {
        self.most(|_| true, Runs::with_behind)
            + self.tasks.range(..=priority).map(|(_, cycles)| cycles).sum::<u64>()
    }

    /// How many come within so many cycles, at most, while no task below this priority runs.
    pub fn times(&self, within: u64, priority: u8) -> u64 {
        self.come(within, self.ends(priority))
    }

    /// The same, while no task runs.
    pub fn times_without_tasks(&self, within: u64) -> u64 {
        self.come(within, self.needed.is_some())
    }

    fn come(&self, within: u64, ends: bool) -> u64 {
        let Event { every, at_once, most, sources, .. } = *self.event;
        let times = u64::from(at_once - 1) + within.div_ceil(every);
        u64::from(sources) * if ends { times.min(most.unwrap_or(at_once).into()) } else { times }
    }

    /// Whether no more than some come while no task below this priority runs.
    fn ends(&self, priority: u8) -> bool {
        self.needed.is_some_and(|needed| needed > priority)
    }

    /// After how many cycles the one of this number comes, from 1, where they come as soon as they can.
    pub fn arrives(&self, number: u64) -> u64 {
        let [at_once, sources] = [self.event.at_once, self.event.sources].map(u64::from);
        number.saturating_sub(at_once * sources).div_ceil(sources).saturating_mul(self.event.every)
    }

    /// The share of the CPU that it takes in the long run while no task below this priority runs.
    pub fn share(&self, priority: u8) -> f64 {
        if self.ends(priority) { 0.0 } else { self.of_cpu(self.cycles(priority)) }
    }

    /// The share of the CPU that it takes in the long run if each takes so many cycles.
    pub fn of_cpu(&self, cycles: u64) -> f64 {
        f64::from(self.event.sources) * cycles as f64 / self.event.every as f64
    }
}

/// What the interrupted program executes behind an interrupt that returns by `reti`, in cycles: an
/// instruction, which may be the first of a critical section, and one more behind that section. Behind any
/// other it executes nothing.
fn behind(vector: u8, bounds: &Bounds) -> u64 {
    let mut interrupts = bounds.interrupts.iter();
    let by_reti = interrupts.any(|interrupt| interrupt.vector == vector && interrupt.masked_last > 0);
    if by_reti { BETWEEN + bounds.masked_by_instructions() + BETWEEN } else { 0 }
}

/// So many times so many cycles, or for ever.
pub fn all_of(times: u64, cycles: u64) -> u64 {
    times.saturating_mul(cycles).min(PATIENCE)
}
