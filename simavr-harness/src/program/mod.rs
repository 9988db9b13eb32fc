//! The program behind `./x sim` and `./x bench`.

mod arguments;
mod bench;
mod display;
mod json;
mod listing;
mod observer;
mod report;
mod view;

use std::error::Error;
use std::io::IsTerminal;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use clap::Parser;
use simavr_harness::{CLOCK_HZ, Engine, Image, Images, Robot, RobotBuilder};

use arguments::{Arguments, Command, Shape};
use display::Display;
use observer::Observer;
use report::Report;

/// How often the display follows the robot, in simulated cycles: 20 ms.
const STEP: u64 = CLOCK_HZ as u64 / 50;

/// Exit status 0: the robot did as it should, or the figures are printed. 1: it did not. 2: nothing could be run.
pub fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        Command::Sim(options) => run(&options).map(|report| report.is_right()),
        Command::Bench(options) => bench::run(&options).map(|()| true),
    };
    match result {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("superbot-sim: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(options: &arguments::Sim) -> Result<Report, Box<dyn Error>> {
    let images = load_images(&options.images)?;
    let mut engine = Engine::new(build_robot(images, options)?, options.threads);
    let mut observer = Observer::new(engine.robot());
    let mut display = Display::new(options.json.is_none() || std::io::stderr().is_terminal());
    let end = (options.seconds * f64::from(CLOCK_HZ)) as u64;
    let started = Instant::now();
    while engine.cycle() < end {
        let target = (engine.cycle() + STEP).min(end);
        engine.run_until(target);
        observer.take(&engine.take_events());
        display.show(engine.robot(), &observer, target, end, started.elapsed())?;
    }
    display.finish();
    let report = Report::new(engine.robot(), &observer, end, started.elapsed())?;
    match &options.json {
        Some(path) => json::write(&report, path)?,
        None => print!("{report}"),
    }
    for fault in report.faults() {
        eprintln!("superbot-sim: {fault}");
    }
    Ok(report)
}

fn load_images(directory: &Path) -> Result<Images, Box<dyn Error>> {
    let load = |name| Image::load(directory.join(name)).map(Arc::new);
    Ok(Images { master: load("firmware-master.elf")?, slave: load("firmware-slave.elf")? })
}

fn build_robot(images: Images, options: &arguments::Sim) -> Result<Robot, Box<dyn Error>> {
    let builder = match options.shape {
        Shape::Chain => RobotBuilder::chain(images, options.modules),
    };
    Ok(builder.seed(options.seed).build()?)
}
