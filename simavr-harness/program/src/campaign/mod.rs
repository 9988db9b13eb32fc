//! `./x campaign` writes many runs as a list of jobs, and `./x report` reports their results.

mod file;
mod jobs;
mod options;
mod parquet;
mod plan;
mod plot;
mod report;
mod results;
mod start;
mod statistics;
mod summary;

use std::error::Error;
use std::fs;
use std::path::Path;

use super::json::Destination;
use super::output::print;
use jobs::Jobs;
use plan::Plan;
use results::Outcome;

pub use options::{Campaign, CampaignReport};
pub use report::run as report;

/// Writes the list of jobs, and either says how to run it or runs it. Returns `false` if it was run, and a
/// run is not done or has failed.
pub fn run(options: &Campaign) -> Result<bool, Box<dyn Error>> {
    let plan = Plan::of_file(&options.file, &options.images)?;
    let jobs = Jobs::new(&plan, &options.directory)?;
    jobs.write(&options.file)?;
    print(count(&results::read(&options.directory, &plan)?))?;
    if !options.run {
        print(jobs.advice(options.jobs)?)?;
        return Ok(true);
    }
    start::start(&jobs, options.jobs)?;
    let outcomes = results::read(&options.directory, &plan)?;
    print(count(&outcomes))?;
    Ok(outcomes.iter().all(|outcome| outcome.is_done() && !outcome.has_failed()))
}

fn count(outcomes: &[Outcome]) -> String {
    let done = outcomes.iter().filter(|outcome| outcome.is_done()).count();
    let failed = outcomes.iter().filter(|outcome| outcome.has_failed()).count();
    format!("runs: {}, done: {done}, failed: {failed}\n", outcomes.len())
}

/// Writes `content` whole or not at all.
fn write(path: &Path, content: impl AsRef<[u8]>) -> Result<(), Box<dyn Error>> {
    Destination::file(path, None, "DIR")?.write_bytes(content.as_ref())
}

/// A path as text, for a job.
fn text(path: &Path) -> Result<String, Box<dyn Error>> {
    Ok(path.to_str().ok_or_else(|| format!("{} is not UTF-8: give it another name", path.display()))?.into())
}

fn read(path: &Path) -> Result<String, Box<dyn Error>> {
    fs::read_to_string(path).map_err(|error| format!("can't read {}: {error}", path.display()).into())
}
