//! What comes to an MCU, how often at most, and which code that has run: what somebody who knows wrote down.

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
    /// What an interrupt takes more where it wakes a task that has to wait for others.
    pub wake: Option<Run>,
    /// Names for what several runs pass by: `@name` stands for all of a set.
    #[serde(default)]
    pub sets: BTreeMap<String, Vec<String>>,
}

/// Something that comes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Event {
    pub name: String,
    /// Why no more often than `every`.
    pub why: String,
    /// Cycles between two of them, at least; but for those that come [at once](Self::at_once).
    pub every: u64,
    /// How many may come at once.
    #[serde(default = "one")]
    pub at_once: u16,
    /// How many sources there are, each with events that come so often.
    #[serde(default = "one")]
    pub sources: u16,
    /// The task without which no more of them come.
    pub needs: Option<String>,
    /// How many come at most until that task runs: if it is not said, as many as [at once](Self::at_once).
    pub most: Option<u16>,
    /// What each of them has run.
    pub runs: Vec<Run>,
    /// What it may have interrupts run instead.
    #[serde(default)]
    pub or: Vec<Run>,
}

/// A run of code: of an interrupt's, or a turn of a task's loop.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    pub vector: Option<u8>,
    /// The function with the loop that is noted as a task's job.
    pub job: Option<String>,
    /// A function, from its call to its return.
    pub function: Option<String>,
    /// Which of its jobs, in the order of flash, from 0.
    #[serde(default)]
    pub turn: usize,
    /// The task whose job it is.
    pub by: Option<String>,
    #[serde(default = "one")]
    pub times: u16,
    /// Functions that it does not call, and variables that its instructions do not name.
    #[serde(default)]
    pub without: Vec<String>,
    /// Only what it takes more than if it were without these as well.
    #[serde(default)]
    pub beyond: Vec<String>,
    /// Notes as in `loops.txt`, in place of those that are there, for this run alone.
    #[serde(default)]
    pub notes: String,
}

/// A task.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Task {
    pub name: String,
    /// What the image calls its body.
    pub body: String,
    /// The most important is 0.
    pub priority: u8,
    /// The event to which it responds.
    pub answers: Option<String>,
    /// Where there is none: the function whose loops have its jobs. A `*` stands for the rest of the name.
    pub jobs: Option<String>,
    /// Within how many cycles it should.
    pub deadline: Option<u64>,
    /// What other tasks of lower priority may do while this one has to wait: calls in which they hold a
    /// mutex.
    #[serde(default)]
    pub waits_for: Vec<Run>,
    /// Why there is no bound, where there is none.
    pub unbounded: Option<String>,
}

/// By when an interrupt has to have done something.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Deadline {
    pub vector: u8,
    /// Cycles from where its flag is set.
    pub within: u64,
    /// What is lost after that.
    pub why: String,
    /// What it has run by then.
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
    #[error("\"{name}\": every, at_once and sources are 1 at least")]
    Zero { name: String },
}

impl Releases {
    /// Reads files as one.
    ///
    /// # Errors
    /// A file cannot be read, or is none of these.
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

/// What a name stands for: itself, or those of a set. One of a set that is not there is refused where it is
/// used.
fn members(name: &str, sets: &BTreeMap<String, Vec<String>>) -> Vec<String> {
    let set = name.strip_prefix('@').and_then(|set| sets.get(set));
    set.cloned().unwrap_or_else(|| vec![name.to_owned()])
}
