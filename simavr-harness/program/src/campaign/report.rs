//! `./x report`: tables of what came of a campaign's runs, and plots.

use std::error::Error;
use std::fmt::Write;

use super::super::json::Destination;
use super::super::output::print;
use super::CampaignReport;
use super::jobs;
use super::parquet::parquet;
use super::plan::Plan;
use super::plot;
use super::results::{self, Outcome, Row};
use super::summary::Summary;

/// Runs that failed are told up to this number; all are in the table.
const MOST_FAILURES: usize = 20;

/// Of what a run did wrong so many lines are told.
const MOST_FAULTS: usize = 3;

/// Writes the tables, and prints the summary.
pub fn run(options: &CampaignReport) -> Result<(), Box<dyn Error>> {
    let path = jobs::plan_path(&options.directory);
    let text =
        super::read(&path).map_err(|error| format!("{error}; ./x campaign FILE.toml DIR makes one"))?;
    let plan: Plan = serde_json::from_str(&text).map_err(|error| {
        format!("{} is no campaign: {error}; ./x campaign writes it anew", path.display())
    })?;
    let outcomes = results::read(&options.directory, &plan)?;
    let rows: Vec<Row> = outcomes.iter().map(Outcome::row).collect::<Result<_, _>>()?;
    if let [figure, parameter, svg] = [&options.plot, &options.against, &options.svg].map(Option::as_deref)
        && let (Some(figure), Some(parameter), Some(svg)) = (figure, parameter, svg)
    {
        let destination = Destination::file(svg.as_ref(), None, "--svg")?;
        destination.write_text(&plot::plot(
            &plot::curves(&outcomes, figure, parameter)?,
            figure,
            parameter,
        )?)?;
    }
    let summary = Summary::of(&outcomes)?;
    let columns = results::columns(&rows);
    super::write(&options.directory.join("runs.csv"), results::csv(&columns, &rows)?)?;
    super::write(&options.directory.join("runs.parquet"), parquet(&columns, &rows)?)?;
    super::write(&options.directory.join("summary.csv"), summary.csv()?)?;
    print(summary)?;
    print(failures(&outcomes)?)
}

/// The runs that failed, each with the command that runs it again, and how many are to come.
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
        writeln!(text, "\n{} more have failed: see exit_status in runs.csv", failed.len() - MOST_FAILURES)?;
    }
    match outcomes.iter().filter(|outcome| outcome.status.is_none()).count() {
        0 => {}
        missing => writeln!(text, "\nstill to run: {missing}")?,
    }
    Ok(text)
}
