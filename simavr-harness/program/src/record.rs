//! `./x sim --record`: the run as a page for a browser.

use std::error::Error;
use std::path::Path;

use simavr_harness::ground;
use simulation::{MILLISECOND, Recording, Scenario};
use viewer::{Block, Ground, Stair, Subject};
use world::Steps;

use super::arguments::{EngineName, Sim, Source, at_most};
use super::json::Destination;
use super::report::Report;
use super::scenario::has_world;

/// The sampling period of a run, in cycles: 40 ms. The page interpolates between two samples.
pub const EVERY: u64 = 40 * MILLISECOND;

/// The largest product of modules and seconds: a page of 12 MB, which takes 300 MB of memory to make and 100
/// MB in a browser.
const MOST: f64 = 100_000.0;

/// A page to be written.
pub struct Record {
    destination: Destination,
    subject: Subject,
}

impl Record {
    /// Makes sure, before the run takes its time, that the page can be written if one is asked for, and that
    /// it overwrites neither the `robot_file` nor the report.
    ///
    /// # Errors
    /// The page can't be written there.
    pub fn of(
        options: &Sim,
        robot_file: Option<&Path>,
        report: Option<&Destination>,
        scenario: &Scenario,
    ) -> Result<Option<Self>, Box<dyn Error>> {
        let Some(path) = &options.record else { return Ok(None) };
        if path == Path::new("-") {
            return Err("the standard output has the summary: give --record a file".into());
        }
        let modules = scenario.wiring.modules();
        expect_small(modules, options.seconds, "--record")?;
        let destination = Destination::besides(report, path, robot_file, "--record")?;
        Ok(Some(Record { destination, subject: subject(options, scenario) }))
    }

    /// The destination of the page.
    pub fn destination(&self) -> &Destination {
        &self.destination
    }

    /// Writes the page.
    ///
    /// # Errors
    /// The page can't be written.
    pub fn write(mut self, report: &Report, recording: &Recording) -> Result<(), Box<dyn Error>> {
        self.subject.seconds = report.simulated_seconds;
        self.subject.summary = report.to_string();
        self.subject.faults = report.faults().to_vec();
        self.destination.write_text(&viewer::page(&self.subject, recording)?)
    }
}

/// Makes sure that a browser can hold a page of `modules` modules and `seconds` seconds, which `option` asks
/// for.
///
/// # Errors
/// The page would be too large.
pub fn expect_small(modules: usize, seconds: f64, option: &str) -> Result<(), Box<dyn Error>> {
    if modules as f64 * seconds <= MOST {
        return Ok(());
    }
    Err(format!(
        "{modules} modules for {seconds} s would make a page too large for a browser: leave {option} out, \
         or ask for {} s at most, or for fewer modules",
        at_most(MOST / modules as f64)
    )
    .into())
}

/// The description of the run that a page has before the run begins.
pub fn subject(options: &Sim, scenario: &Scenario) -> Subject {
    let robot = match &options.robot {
        Source::Shape(shape) => shape.name().into(),
        Source::File(path) => path.file_stem().unwrap_or_default().to_string_lossy().into(),
    };
    let engine = match options.engine {
        EngineName::Simavr => "simavr",
        EngineName::Host => "host",
    };
    let terrain = scenario.terrain.clone().unwrap_or_default();
    Subject {
        robot,
        engine: engine.into(),
        seconds: options.seconds,
        seed: options.seed,
        ground: has_world(options).then(|| of_world(ground(&terrain))),
        summary: String::new(),
        faults: Vec::new(),
    }
}

/// Converts the world's ground to the page's types.
fn of_world(ground: world::Ground) -> Ground {
    let stair = |Steps { from, height, length, number }| Stair { from, height, length, number };
    let block = |world::Block { at, size, turn }| Block { at, size, turn };
    Ground {
        slope: ground.slope,
        stair: ground.steps.map(stair),
        blocks: ground.blocks.into_iter().map(block).collect(),
    }
}
