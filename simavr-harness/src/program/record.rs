//! `./x sim --record`: the run as a page, to be looked at.

use std::error::Error;
use std::path::Path;

use simavr_harness::ground;
use simulation::{MILLISECOND, Recording, Scenario};
use viewer::{Block, Ground, Stair, Subject};
use world::Steps;

use super::arguments::{EngineName, Sim, Source};
use super::json::Destination;
use super::report::Report;
use super::sim::has_world;

/// How often a run is looked at, in cycles: 40 ms. The page shows what is between two looks by their mean.
pub const EVERY: u64 = 40 * MILLISECOND;

/// The most modules times seconds: a page of 12 MB, which takes 300 MB here to make and 100 MB in a browser.
const MOST: f64 = 100_000.0;

/// A page to be written.
pub struct Record {
    destination: Destination,
    robot: String,
    ground: Option<Ground>,
}

impl Record {
    /// Makes sure, before anything has taken its time, that the page can be written if one is asked for: not
    /// over the `robot_file`, nor where the report goes.
    ///
    /// # Errors
    /// It can't.
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
        if modules as f64 * options.seconds > MOST {
            return Err(format!(
                "{modules} modules for {} s would make a page too large for a browser: record {:.0} s at most, \
                 or fewer modules",
                options.seconds,
                (MOST / modules as f64).floor()
            )
            .into());
        }
        let destination = Destination::file(path, robot_file, "--record")?;
        if report.is_some_and(|report| report.is(&destination)) {
            return Err(format!("{} is for --json already: give --record another", path.display()).into());
        }
        let robot = match &options.robot {
            Source::Shape(shape) => shape.name().into(),
            Source::File(path) => path.file_stem().unwrap_or_default().to_string_lossy().into(),
        };
        let terrain = scenario.terrain.clone().unwrap_or_default();
        let ground = has_world(options).then(|| of_world(ground(&terrain)));
        Ok(Some(Record { destination, robot, ground }))
    }

    /// Where the page goes.
    pub fn destination(&self) -> &Destination {
        &self.destination
    }

    /// Writes the page.
    ///
    /// # Errors
    /// It can't be written.
    pub fn write(self, options: &Sim, report: &Report, recording: &Recording) -> Result<(), Box<dyn Error>> {
        let engine = match options.engine {
            EngineName::Simavr => "simavr",
            EngineName::Host => "host",
        };
        let subject = Subject {
            robot: self.robot,
            engine: engine.into(),
            seconds: report.simulated_seconds,
            seed: options.seed,
            ground: self.ground,
            summary: report.to_string(),
            faults: report.faults().to_vec(),
        };
        self.destination.write_text(&viewer::page(&subject, recording)?)
    }
}

/// The world's ground in the page's words.
fn of_world(ground: world::Ground) -> Ground {
    let stair = |Steps { from, height, length, number }| Stair { from, height, length, number };
    let block = |world::Block { at, size, turn }| Block { at, size, turn };
    Ground {
        slope: ground.slope,
        stair: ground.steps.map(stair),
        blocks: ground.blocks.into_iter().map(block).collect(),
    }
}
