//! `./x campaign`: many runs as a list of jobs, and `./x report`: what came of them.

mod file;
mod jobs;
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

use super::arguments::Campaign;
use super::json::Destination;
use super::output::print;
use jobs::Jobs;
use plan::Plan;

pub use report::run as report;

/// Writes what there is to run, and says how to run it, or does. Returns whether all runs that were started
/// did as they should.
pub fn run(options: &Campaign) -> Result<bool, Box<dyn Error>> {
    let plan = Plan::of_file(&options.file, &options.images)?;
    let jobs = Jobs::new(&plan, &options.directory)?;
    jobs.write()?;
    let results = results::read(&options.directory, &plan)?;
    let done = results.iter().filter(|result| result.is_done()).count();
    print(format_args!("{} runs, {done} of them done\n", plan.runs.len()))?;
    if !options.run {
        print(jobs.advice(options.jobs)?)?;
        return Ok(true);
    }
    start::start(&jobs, options.jobs)?;
    let results = results::read(&options.directory, &plan)?;
    let done = results.iter().filter(|result| result.is_done()).count();
    let failed = results.iter().filter(|result| result.has_failed()).count();
    print(format_args!("{} runs, {done} of them done, {failed} failed\n", plan.runs.len()))?;
    Ok(done == plan.runs.len() && failed == 0)
}

/// Writes `text` whole or not at all.
fn write(path: &Path, text: &str) -> Result<(), Box<dyn Error>> {
    Destination::file(path, None, "DIR")?.write_text(text)
}

fn read(path: &Path) -> Result<String, Box<dyn Error>> {
    fs::read_to_string(path).map_err(|error| format!("can't read {}: {error}", path.display()).into())
}
