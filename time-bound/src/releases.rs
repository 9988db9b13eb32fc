//! The events that come to an MCU, how often at most, and the code that they run, written down by hand.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use thiserror::Error;

/// A TOML file, or several that are read as one.
///
/// ```toml
/// [[event]]
/// name = "a character comes in at USART0"
/// why = "10 bits at 38400 baud"
/// every = 4160
/// runs = [{ vector = 18 }]
///
/// [[task]]
/// name = "joints' control"
/// body = "firmware_master::start::{closure#10}"
/// priority = 0
/// answers = "a period begins"
/// deadline = 16000
/// ```
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Releases {
    #[serde(default, rename = "event")]
    pub events: Vec<Event>,
    #[serde(default, rename = "task")]
    pub tasks: Vec<Task>,
    #[serde(default, rename = "deadline")]
    pub deadlines: Vec<Deadline>,
    /// The additional run of an interrupt that wakes a task that then has to wait for others.
    pub wake: Option<Run>,
    /// Sets of names that several runs avoid: `@name` stands for all of a set.
    #[serde(default)]
    pub sets: BTreeMap<String, Vec<String>>,
}

/// An event that comes again and again.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Event {
    pub name: String,
    /// Why it comes no more often than `every`.
    pub why: String,
    /// Cycles between two events, at least, except for those that come [at once](Self::at_once).
    pub every: u64,
    /// How many may come at once.
    #[serde(default = "one")]
    pub at_once: u16,
    /// How many sources there are. The events of each come that often.
    #[serde(default = "one")]
    pub sources: u16,
    /// The task that has to run before more of these events come.
    pub needs: Option<String>,
    /// How many come at most until that task runs; by default as many as [at once](Self::at_once).
    pub most: Option<u16>,
    /// The runs that each event causes.
    pub runs: Vec<Run>,
    /// The interrupt runs that it may cause instead.
    #[serde(default)]
    pub or: Vec<Run>,
}

/// A run of code: an interrupt, an iteration of a task's loop, or a function.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    pub vector: Option<u8>,
    /// The function with the loop that is noted as a task's job.
    pub job: Option<String>,
    /// A function, from its call to its return.
    pub function: Option<String>,
    /// The index of the job among that function's jobs, in the order of flash, from 0.
    #[serde(default)]
    pub turn: usize,
    /// The task whose job it is.
    pub by: Option<String>,
    #[serde(default = "one")]
    pub times: u16,
    /// Functions that this run does not call, and variables that its instructions do not name.
    #[serde(default)]
    pub without: Vec<String>,
    /// If there are any: count only the cycles beyond those of a run without these as well.
    #[serde(default)]
    pub beyond: Vec<String>,
    /// Notes as in `loops.txt`, which replace those of that file for this run alone.
    #[serde(default)]
    pub notes: String,
}

/// A task.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Task {
    pub name: String,
    /// The name of its body in the image.
    pub body: String,
    /// 0 is the highest.
    pub priority: u8,
    /// The event to which it responds.
    pub answers: Option<String>,
    /// If there is none: the function whose loops have its jobs. A `*` stands for the rest of the name.
    pub jobs: Option<String>,
    /// Within how many cycles it should respond.
    pub deadline: Option<u64>,
    /// Calls in which tasks of lower priority hold a mutex, and for which this task may have to wait.
    #[serde(default)]
    pub waits_for: Vec<Run>,
    /// Why there is no bound, where there is none.
    pub unbounded: Option<String>,
}

/// The deadline by which an interrupt has to have done its work.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Deadline {
    pub vector: u8,
    /// Cycles from the setting of its flag.
    pub within: u64,
    /// What is lost if it misses the deadline.
    pub why: String,
    /// The run that has to be done by then.
    pub until: Run,
    /// Interrupts that do not come while this one waits, by vector.
    #[serde(default)]
    pub excludes: Vec<u8>,
}

fn one() -> u16 {
    1
}

/// Why the files cannot be used.
#[derive(Debug, Error)]
pub enum ReleaseError {
    #[error("cannot read {}: {source}", .path.display())]
    Unreadable { path: PathBuf, source: std::io::Error },
    #[error("{}: {source}", .path.display())]
    Malformed { path: PathBuf, source: toml::de::Error },
    #[error("\"{name}\": every, at_once and sources must be at least 1")]
    Zero { name: String },
}

impl Releases {
    /// Reads files as one.
    ///
    /// # Errors
    /// A file cannot be read or is malformed, or an event has a 0 where 1 is the least.
    pub fn load<P: AsRef<Path>>(paths: &[P]) -> Result<Self, ReleaseError> {
        let mut releases = Releases::default();
        for path in paths.iter().map(AsRef::as_ref) {
            let text = std::fs::read_to_string(path)
                .map_err(|source| ReleaseError::Unreadable { path: path.to_owned(), source })?;
            let more: Releases = toml::from_str(&text)
                .map_err(|source| ReleaseError::Malformed { path: path.to_owned(), source })?;
            releases.events.extend(more.events);
            releases.tasks.extend(more.tasks);
            releases.deadlines.extend(more.deadlines);
            releases.wake = more.wake.or(releases.wake);
            releases.sets.extend(more.sets);
        }
        let Releases { events, tasks, deadlines, wake, sets } = &mut releases;
        if let Some(event) =
            events.iter().find(|event| event.every == 0 || event.at_once == 0 || event.sources == 0)
        {
            return Err(ReleaseError::Zero { name: event.name.clone() });
        }
        let of_events = events.iter_mut().flat_map(|event| event.runs.iter_mut().chain(&mut event.or));
        let of_tasks = tasks.iter_mut().flat_map(|task| &mut task.waits_for);
        let of_interrupts = deadlines.iter_mut().map(|deadline| &mut deadline.until);
        for run in of_events.chain(of_tasks).chain(of_interrupts).chain(wake) {
            for names in [&mut run.without, &mut run.beyond] {
                *names = names.iter().flat_map(|name| members(name, sets)).collect();
            }
        }
        Ok(releases)
    }
}

/// The names that a name stands for: itself, or those of a set. The name of an unknown set is refused where
/// it is used.
fn members(name: &str, sets: &BTreeMap<String, Vec<String>>) -> Vec<String> {
    let set = name.strip_prefix('@').and_then(|set| sets.get(set));
    set.cloned().unwrap_or_else(|| vec![name.to_owned()])
}
