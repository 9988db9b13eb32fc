//! Events with their costs.

use std::collections::BTreeMap;

use crate::bounds::Bounds;
use crate::costs::Costs;
use crate::problem::Problem;
use crate::releases::{Event, Releases, Run};

/// An iteration that exceeds this, in cycles, stops: the CPU then counts as busy for ever. 10 s.
pub const PATIENCE: u64 = 160_000_000;

/// After `reti` and after an instruction that enables interrupts, the program executes one instruction before
/// the next interrupt. The longest is an `sbi` that reads the EEPROM: 2 cycles, and 4 for which the core
/// waits.
pub const BETWEEN: u64 = 6;

/// Runs of an interrupt.
pub struct Runs {
    pub vector: Option<u8>,
    times: u64,
    /// Of all runs together.
    cycles: u64,
    /// The cycles that the interrupted program executes after each of them though an interrupt is pending.
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

    /// The cycles of one run.
    pub fn longest(&self) -> u64 {
        self.cycles / self.times.max(1)
    }
}

/// An event with its costs: of interrupts, and of each task by priority.
pub struct Costed<'a> {
    pub event: &'a Event,
    /// The priority of the task that has to run before more of these events come.
    needed: Option<u8>,
    /// The interrupt runs that it causes, or the others that may come instead.
    pub runs: [Vec<Runs>; 2],
    pub tasks: BTreeMap<u8, u64>,
}

impl<'a> Costed<'a> {
    /// The costs of an event.
    ///
    /// # Errors
    /// Each problem that keeps a run from having a bound, and names of tasks that are not listed.
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

    /// The cycles of its interrupts.
    pub fn interrupts(&self) -> u64 {
        self.most(|_| true, |run| run.cycles)
    }

    /// The cycles of its interrupts with such vectors, and of the code that runs after each though another is
    /// pending.
    pub fn interrupts_of(&self, is_such: impl Fn(u8) -> bool) -> u64 {
        self.most(|run| run.vector.is_some_and(&is_such), Runs::with_behind)
    }

    fn most(&self, counts: impl Fn(&&Runs) -> bool, cycles: impl Fn(&Runs) -> u64) -> u64 {
        let of = |runs: &[Runs]| runs.iter().filter(&counts).map(&cycles).sum::<u64>();
        let [runs, instead] = &self.runs;
        of(runs).max(of(instead))
    }

    /// The cycles of its interrupts, with those that a lower task executes after each, and of tasks of this
    /// priority or a higher one.
    pub fn cycles(&self, priority: u8) -> u64 {
        self.most(|_| true, Runs::with_behind)
            + self.tasks.range(..=priority).map(|(_, cycles)| cycles).sum::<u64>()
    }

    /// How many come within so many cycles, at most, while no task of lower priority runs.
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

    /// Whether only a limited number comes while no task of lower priority runs.
    fn ends(&self, priority: u8) -> bool {
        self.needed.is_some_and(|needed| needed > priority)
    }

    /// When the event of this number comes, counted from 1, in cycles, if events come as soon as they can.
    pub fn arrives(&self, number: u64) -> u64 {
        let [at_once, sources] = [self.event.at_once, self.event.sources].map(u64::from);
        number.saturating_sub(at_once * sources).div_ceil(sources).saturating_mul(self.event.every)
    }

    /// The share of the CPU that it takes in the long run while no task of lower priority runs.
    pub fn share(&self, priority: u8) -> f64 {
        if self.ends(priority) { 0.0 } else { self.of_cpu(self.cycles(priority)) }
    }

    /// The share of the CPU that it takes in the long run if each takes so many cycles.
    pub fn of_cpu(&self, cycles: u64) -> f64 {
        f64::from(self.event.sources) * cycles as f64 / self.event.every as f64
    }
}

/// The cycles that the interrupted program executes after an interrupt though another is pending. After
/// `reti` these are an instruction, which may begin a critical section, and one more after that section.
/// After any other return there are none.
fn behind(vector: u8, bounds: &Bounds) -> u64 {
    let mut interrupts = bounds.interrupts.iter();
    let by_reti = interrupts.any(|interrupt| interrupt.vector == vector && interrupt.masked_last > 0);
    if by_reti { BETWEEN + bounds.masked_by_instructions() + BETWEEN } else { 0 }
}

/// `times` times `cycles`, limited to [`PATIENCE`], which stands for ever.
pub fn all_of(times: u64, cycles: u64) -> u64 {
    times.saturating_mul(cycles).min(PATIENCE)
}
