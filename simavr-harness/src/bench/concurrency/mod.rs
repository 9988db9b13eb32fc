//! Compares tasks with one loop: the same module, once with the kernel's tasks and once as a sequential
//! program, in the same cases (paper, section 1: "The sequential programming style is inadequate for this
//! purpose").
//!
//! Only the master differs. The slave and the module's surroundings are the same.

mod case;
mod size;
mod watch;

use std::path::Path;
use std::thread;

use serde::Serialize;

use super::module::{MEASURED, ModuleImages, SECOND, babble, join, milliseconds, step};
use super::{BenchError, unmeasurable};
use crate::Controller;
use crate::engine::Engine;
use crate::robot::RobotBuilder;
use simulation::Face;
use tasks::dock::Dock;

pub use case::{Case, Row, run};
pub use size::Size;
pub use watch::Periodic;

/// How the master is programmed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Style {
    Tasks,
    Loop,
}

impl Style {
    pub const ALL: [Style; 2] = [Style::Tasks, Style::Loop];

    /// The master's image under the images' directory, as a module would be flashed with.
    fn image(self) -> &'static str {
        match self {
            Style::Tasks => "firmware-master.elf",
            Style::Loop => "sequential/sequential-master.elf",
        }
    }

    /// The master's image with the additions of the bench.
    fn trial(self) -> &'static str {
        match self {
            Style::Tasks => "trial/firmware-master.elf",
            Style::Loop => "trial/sequential-master.elf",
        }
    }
}

/// All results.
#[derive(Clone, Debug, Serialize)]
pub struct Concurrency {
    /// The length of each case, in simulated seconds.
    pub seconds: u64,
    pub styles: Vec<Program>,
    pub cases: Vec<Row>,
}

/// The results that do not depend on a case.
#[derive(Clone, Debug, Serialize)]
pub struct Program {
    pub style: Style,
    pub size: Size,
    /// The share of time in which the master is awake in the middle of a chain whose joints are at rest, in
    /// percent.
    pub cpu_at_rest_percent: f64,
    /// On a step of 30 degrees: the overshoot of a joint, in percent, and its error in the end.
    pub step_overshoot_percent: f64,
    pub step_error_deg: f64,
    /// The longest time in ms until the module is back in the robot after garbage at all docks has ended.
    pub babble_recovery_ms: f64,
}

/// Measures both styles on the images in `directory`, each case for `seconds` seconds.
///
/// # Errors
/// An image is missing, or does not do what is to be measured.
pub fn measure(directory: &Path, seconds: u64) -> Result<Concurrency, BenchError> {
    let images = Style::ALL.into_iter().flat_map(|style| [style.image(), style.trial()]);
    if let Some(image) = images.into_iter().find(|image| !directory.join(image).is_file()) {
        let place = directory.join(image).display().to_string();
        return Err(unmeasurable(&place, "it does not exist; ./x bench concurrency builds it"));
    }
    thread::scope(|scope| {
        let programs = Style::ALL.map(|style| scope.spawn(move || program(directory, style)));
        let runs = Style::ALL.map(|style| {
            let run = move |case| scope.spawn(move || run(directory, case, style, seconds));
            Case::ALL.into_iter().filter(|case| case.is_of(style)).map(run).collect::<Vec<_>>()
        });
        let mut rows = Vec::new();
        for run in runs.into_iter().flatten() {
            rows.push(join(run)?);
        }
        rows.sort_by_key(|row: &Row| Case::ALL.iter().position(|case| *case == row.case));
        let mut styles = Vec::new();
        for program in programs {
            styles.push(join(program)?);
        }
        Ok(Concurrency { seconds, styles, cases: rows })
    })
}

/// Measures what does not depend on a case, for one style.
fn program(directory: &Path, style: Style) -> Result<Program, BenchError> {
    let images =
        ModuleImages { directory: directory.to_owned(), master: Some(directory.join(style.image())) };
    let step = step::measure(&images)?;
    Ok(Program {
        style,
        size: Size::of(&images.firmware()?.master, style),
        cpu_at_rest_percent: at_rest(&images)?,
        step_overshoot_percent: step.overshoot_percent,
        step_error_deg: step.error,
        babble_recovery_ms: milliseconds(babble::measure(&images)?.recovery),
    })
}

/// The CPU load of the measured module's master between two neighbours, in percent.
fn at_rest(images: &ModuleImages) -> Result<f64, BenchError> {
    let mut engine = Engine::new(chain(images, 3)?.build()?, 1);
    engine.run_until(2 * SECOND);
    let awake = |engine: &Engine| {
        engine.robot().module(MEASURED).map_or(0, |module| module.mcu(Controller::Master).awake_cycles())
    };
    let before = awake(&engine);
    engine.run_until(engine.cycle() + 10 * SECOND);
    Ok(100.0 * (awake(&engine) - before) as f64 / (10 * SECOND) as f64)
}

/// The measured module between a head and a tail, in a robot of `modules` modules.
fn chain(images: &ModuleImages, modules: usize) -> Result<RobotBuilder, BenchError> {
    Ok(RobotBuilder::new(images.firmware()?, modules)
        .attach(Face { module: MEASURED, dock: Dock::Front }, Face { module: 1, dock: Dock::Back })
        .attach(Face { module: MEASURED, dock: Dock::Back }, Face { module: 2, dock: Dock::Front })
        .seed(1))
}
