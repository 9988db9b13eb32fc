//! How soon each task has done the work for which it was woken, at most, by the fixed-point iteration of
//! Joseph and Pandya ("Finding Response Times in a Real-Time System", 1986), with blocking, and with releases
//! that may follow each other before the task is done (Lehoczky 1990; Tindell, Burns and Wellings 1994).
//!
//! All interrupts go before all tasks. The worst case begins at a moment at which neither the task nor a
//! higher task nor an interrupt has anything to do: there all events come at once, as often as they can, and
//! a lower task has just begun to mask interrupts or to hold a lock. From that moment on the CPU is busy with
//! the task, higher tasks and interrupts.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

use crate::bounds::{Bounds, Interrupt};
use crate::costed::{BETWEEN, Costed, PATIENCE, all_of};
use crate::costs::Costs;
use crate::latency::Latency;
use crate::problem::Problem;
use crate::releases::{Releases, Task};

/// The load of an event on the CPU.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Load {
    pub event: String,
    /// Cycles between two events, at least.
    pub every: u64,
    /// The cycles that one event takes in interrupts.
    pub interrupts: u64,
    /// The cycles that one event takes in tasks.
    pub tasks: u64,
    /// The share of the CPU, in percent, if the event came that often for ever: interrupts and tasks.
    pub percent: f64,
}

/// What is known of a task's response.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Response {
    pub task: String,
    pub priority: u8,
    /// The event that it answers.
    pub event: Option<String>,
    /// How long it computes for one event on its own, in cycles; if it answers none, how long its longest job
    /// takes. `None` if no such job is named.
    pub cycles: Option<u64>,
    /// How long lower tasks keep it waiting, in cycles.
    pub blocking: u64,
    /// The share of the CPU that this task, higher tasks and interrupts take, in percent.
    pub percent: f64,
    /// From the event to the end of the job, at most, in cycles.
    pub response: Option<u64>,
    pub deadline: Option<u64>,
    /// Why there is no bound.
    pub unbounded: Option<String>,
}

impl Response {
    /// The time left until the deadline, in cycles; negative if the bound exceeds the deadline.
    pub fn slack(&self) -> Option<i64> {
        Some(self.deadline?.cast_signed() - self.response?.cast_signed())
    }
}

impl fmt::Display for Responses {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        writeln!(to, "interrupts   tasks   every  of CPU  event")?;
        for Load { event, every, interrupts, tasks, percent } in &self.loads {
            writeln!(to, "{interrupts:10} {tasks:7} {every:7} {percent:5.1} %  {event}")?;
        }
        let figure = |figure: Option<i64>| figure.map_or_else(|| "-".to_owned(), |figure| figure.to_string());
        writeln!(to, "blocked   latency   takes   slack  interrupt")?;
        for interrupt in &self.interrupts {
            let Latency { vector, name, blocking, latency, takes, .. } = interrupt;
            let [latency, takes] = [*latency, *takes].map(|cycles| figure(cycles.map(u64::cast_signed)));
            let slack = figure(interrupt.slack());
            writeln!(to, "{blocking:7}  {latency:>8}  {takes:>6}  {slack:>6}  {vector} {name}")?;
        }
        writeln!(to, "computes  blocked  of CPU  response     slack  task")?;
        for task in &self.tasks {
            let Response { task: name, priority, cycles, blocking, percent, .. } = task;
            let [cycles, response] =
                [*cycles, task.response].map(|cycles| figure(cycles.map(u64::cast_signed)));
            let slack = figure(task.slack());
            write!(
                to,
                "{cycles:>8} {blocking:8} {percent:5.0} %  {response:>8}  {slack:>8}  P{priority} {name}"
            )?;
            match &task.unbounded {
                Some(why) => writeln!(to, ": {why}")?,
                None => writeln!(to)?,
            }
        }
        Ok(())
    }
}

/// The loads and the responses of an image.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Responses {
    pub loads: Vec<Load>,
    pub interrupts: Vec<Latency>,
    pub tasks: Vec<Response>,
}

impl Responses {
    /// The responses of an image with these costs and bounds.
    ///
    /// # Errors
    /// Each problem that keeps a run from having a bound, and names of tasks and events that do not fit.
    pub fn new(releases: &Releases, costs: &Costs, bounds: &Bounds) -> Result<Self, Vec<Problem>> {
        let mut problems = Vec::new();
        for body in bounds.tasks.iter().map(|task| &task.name) {
            if !releases.tasks.iter().any(|task| task.body == *body) {
                problems.push(Problem::NotListed { body: body.clone() });
            }
        }
        for body in releases.tasks.iter().map(|task| &task.body) {
            if !bounds.tasks.iter().any(|task| task.name == *body) {
                problems.push(Problem::NoBody { body: body.clone() });
            }
        }
        let mut costed = Vec::new();
        for event in &releases.events {
            match Costed::of(event, releases, costs, bounds) {
                Ok(one) => costed.push(one),
                Err(more) => problems.extend(more),
            }
        }
        let wake = releases.wake.as_ref().map_or(Ok(0), |run| costs.of(run));
        let wake = wake.map_err(|more| problems.extend(more)).unwrap_or(0);
        let mut tasks = Vec::new();
        for task in &releases.tasks {
            match Self::response(task, releases, &costed, wake, costs, bounds) {
                Ok(response) => tasks.push(response),
                Err(more) => problems.extend(more),
            }
        }
        let mut due = BTreeMap::new();
        for deadline in &releases.deadlines {
            match costs.of(&deadline.until) {
                Ok(takes) => drop(due.insert(deadline.vector, (takes, deadline))),
                Err(more) => problems.extend(more),
            }
            if !bounds.interrupts.iter().any(|interrupt| interrupt.vector == deadline.vector) {
                problems.push(Problem::NoInterrupt { vector: deadline.vector });
            }
        }
        problems.sort();
        problems.dedup();
        if !problems.is_empty() {
            return Err(problems);
        }
        let loads = costed.iter().map(|one| {
            let tasks = one.tasks.values().sum();
            Load {
                event: one.event.name.clone(),
                every: one.event.every,
                interrupts: one.interrupts(),
                tasks,
                percent: 100.0 * one.of_cpu(one.interrupts() + tasks),
            }
        });
        let latency = |interrupt: &Interrupt| {
            Latency::of(interrupt, &costed, bounds, due.get(&interrupt.vector).copied())
        };
        let interrupts = bounds.interrupts.iter().map(latency).collect();
        Ok(Responses { loads: loads.collect(), interrupts, tasks })
    }

    fn response(
        task: &Task,
        releases: &Releases,
        costed: &[Costed],
        wake: u64,
        costs: &Costs,
        bounds: &Bounds,
    ) -> Result<Response, Vec<Problem>> {
        let priority = task.priority;
        let mut locked = 0;
        for run in &task.waits_for {
            locked = costs.of(run)?.max(locked);
        }
        // A lower task is woken once at most, and an interrupt pays for its wake-up.
        let below = releases.tasks.iter().filter(|other| other.priority > priority).count() as u64;
        // One critical section may be under way.
        let blocking = locked.max(bounds.masked_by_instructions() + BETWEEN);
        let mut response = Response {
            task: task.name.clone(),
            priority,
            event: task.answers.clone(),
            cycles: None,
            blocking,
            percent: 100.0 * costed.iter().map(|one| one.share(priority)).sum::<f64>(),
            response: None,
            deadline: task.deadline,
            unbounded: task.unbounded.clone(),
        };
        if let Some(function) = &task.jobs {
            let whole = costs.whole_name(function);
            let jobs = bounds.jobs.iter().filter(|job| Some(job.function.as_str()) == whole);
            let missing = || Problem::NoJob { task: task.name.clone(), function: function.clone() };
            response.cycles = Some(jobs.map(|job| job.cycles).max().ok_or_else(|| vec![missing()])?);
        }
        let Some(answers) = &task.answers else {
            let why = task.unbounded.is_some();
            return if why { Ok(response) } else { Err(vec![Problem::NoReason { task: task.name.clone() }]) };
        };
        let own = costed.iter().find(|one| one.event.name == *answers);
        let own =
            own.ok_or_else(|| vec![Problem::NoEvent { task: task.name.clone(), event: answers.clone() }])?;
        response.cycles = own.tasks.get(&priority).copied();
        response.response = longest(own, costed, priority, blocking + below * wake);
        if response.response.is_none() {
            response.unbounded.get_or_insert("the CPU may be busy for ever".to_owned());
        }
        Ok(response)
    }
}

/// The longest response to an event; `None` if the CPU may be busy for ever.
fn longest(own: &Costed, all: &[Costed], priority: u8, once: u64) -> Option<u64> {
    let mut longest = 0;
    for number in 1.. {
        let end = busy(own, all, priority, once, number)?;
        // Events are counted from the moment at which the CPU begins to be busy.
        longest = longest.max(end - own.arrives(number));
        if end <= own.arrives(number + 1) {
            break;
        }
    }
    Some(longest)
}

/// How long the CPU is busy until `number` events have been answered; `None` if it may be busy for ever.
fn busy(own: &Costed, all: &[Costed], priority: u8, once: u64, number: u64) -> Option<u64> {
    let job = own.tasks.get(&priority).copied().unwrap_or(0);
    let mut end = 1;
    while end < PATIENCE {
        let others = all.iter().filter(|one| !std::ptr::eq(*one, own));
        let demand: u64 = others.map(|one| all_of(one.times(end, priority), one.cycles(priority))).sum();
        // Later events interrupt this job, but their own jobs run after it.
        let before = all_of(own.times(end, priority).max(number), own.cycles(priority) - job);
        let next = once + all_of(number, job) + before + demand;
        if next <= end {
            return Some(end);
        }
        end = next;
    }
    None
}
