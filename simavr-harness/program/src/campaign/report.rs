//! `./x report`: tables of the results of a campaign's runs, and plots.

use std::error::Error;
use std::ffi::OsStr;
use std::fmt::Write;
use std::path::Path;

use super::super::json::{Destination, is_same};
use super::super::output::print;
use super::CampaignReport;
use super::jobs;
use super::parquet::parquet;
use super::plan::Plan;
use super::plot;
use super::results::{self, Outcome, Row};
use super::summary::Summary;

/// The most failed runs that are printed; all are in the table.
const MOST_FAILURES: usize = 20;

/// The files that are written to the campaign's directory.
const RUNS: &str = "runs.csv";
const TYPED_RUNS: &str = "runs.parquet";
const SUMMARY: &str = "summary.csv";

/// The most lines that are printed about the faults of a run.
const MOST_FAULTS: usize = 3;

/// Writes the tables, and prints the summary.
pub fn run(options: &CampaignReport) -> Result<(), Box<dyn Error>> {
    let path = jobs::plan_path(&options.directory);
    let text =
        super::read(&path).map_err(|error| format!("{error}; ./x campaign FILE.toml DIR writes it"))?;
    let plan: Plan = serde_json::from_str(&text).map_err(|error| {
        format!("{} is not a campaign: {error}; ./x campaign writes it again", path.display())
    })?;
    let outcomes = results::read(&options.directory, &plan)?;
    let rows: Vec<Row> = outcomes.iter().map(Outcome::row).collect::<Result<_, _>>()?;
    if let [figure, parameter, svg] = [&options.plot, &options.against, &options.svg].map(Option::as_deref)
        && let (Some(figure), Some(parameter), Some(svg)) = (figure, parameter, svg)
    {
        expect_no_other(Path::new(svg), &options.directory)?;
        let destination = Destination::file(svg.as_ref(), None, "--svg")?;
        destination.write_text(&plot::plot(
            &plot::curves(&outcomes, figure, parameter)?,
            figure,
            parameter,
        )?)?;
    }
    let summary = Summary::of(&outcomes)?;
    let written = write_tables(&options.directory, &rows, &summary);
    // The figures are printed even if a table can't be written.
    print(summary)?;
    print(failures(&outcomes)?)?;
    written
}

fn write_tables(directory: &Path, rows: &[Row], summary: &Summary) -> Result<(), Box<dyn Error>> {
    let columns = results::columns(rows);
    super::write(&directory.join(RUNS), results::csv(&columns, rows)?)?;
    super::write(&directory.join(TYPED_RUNS), parquet(&columns, rows)?)?;
    super::write(&directory.join(SUMMARY), summary.csv()?)
}

/// Makes sure that a plot neither overwrites a file of the campaign nor is overwritten by a table.
fn expect_no_other(svg: &Path, directory: &Path) -> Result<(), String> {
    // A link leads to what is overwritten.
    let svg = &svg.canonicalize().unwrap_or_else(|_| svg.into());
    let folder = svg.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let is_table = |name: &OsStr| [RUNS, TYPED_RUNS, SUMMARY].map(OsStr::new).contains(&name);
    let is_taken = |name| is_same(folder, directory) && (jobs::is_own(name) || is_table(name));
    if svg.file_name().is_some_and(is_taken) || is_same(folder, &jobs::results(directory)) {
        return Err(format!("{} belongs to the campaign: give --svg another path", svg.display()));
    }
    Ok(())
}

/// The runs that failed, each with the command that repeats it, and the number of runs that are still to run.
fn failures(outcomes: &[Outcome]) -> Result<String, Box<dyn Error>> {
    let mut text = String::new();
    let failed: Vec<_> = outcomes.iter().filter(|outcome| outcome.has_failed()).collect();
    for Outcome { run, status, faults, .. } in failed.iter().take(MOST_FAILURES) {
        let command = shlex::try_join(run.command.iter().map(String::as_str))?;
        writeln!(text, "\nexit status {}: {command}", status.unwrap_or_default())?;
        for fault in faults.iter().take(MOST_FAULTS) {
            writeln!(text, "  {fault}")?;
        }
        if faults.len() > MOST_FAULTS {
            writeln!(text, "  and {} more", faults.len() - MOST_FAULTS)?;
        }
    }
    if failed.len() > MOST_FAILURES {
        let more = failed.len() - MOST_FAILURES;
        writeln!(text, "\n{more} more runs have failed: see exit_status in runs.csv")?;
    }
    match outcomes.iter().filter(|outcome| outcome.status.is_none()).count() {
        0 => {}
        missing => writeln!(text, "\nstill to run: {missing}")?,
    }
    Ok(text)
}
