//! `./x sim`: runs a robot, shows it live, and says how it did.

use std::error::Error;
use std::io::IsTerminal;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use hormone::gait::GaitName;
use simavr_harness::{Engine, Image, Images, Module, Robot, RobotBuilder, Wiring};
use simulation::{Change, Links, MILLISECOND, Run, Scenario};

use super::arguments::{Sim, Source};
use super::display::Display;
use super::report::Report;
use super::{json, view};

/// Modules get their power at different times, by chance within so many cycles: 40 ms, in which each probes each dock once.
const POWER_UP_WITHIN: u64 = 40 * MILLISECOND;

/// Returns whether the robot did as it should.
pub fn run(options: &Sim) -> Result<bool, Box<dyn Error>> {
    let Scenario { wiring, timeline } = scenario(options)?;
    let images = load_images(&options.images)?;
    check_images(&images, &wiring)?;
    let robot = build_robot(images, &wiring, options)?;
    let is_calm = options.loss == 0.0 && timeline.is_empty();
    let mut run = Run::new(
        Engine::new(robot, options.threads),
        timeline,
        u64::from(GaitName::Centipede.gait().period()) * MILLISECOND,
    );
    let mut display = Display::new(options.json.is_none() || std::io::stderr().is_terminal());
    let end = (options.seconds * 1000.0 * MILLISECOND as f64) as u64;
    let started = Instant::now();
    while run.step(end)? {
        display.show(&run, end, started.elapsed())?;
    }
    display.show(&run, end, started.elapsed())?;
    display.finish();
    let report = Report::new(options, &run, started.elapsed(), is_calm);
    match &options.json {
        Some(path) => json::write(&report, path)?,
        None => print!("{report}"),
    }
    for fault in report.faults() {
        eprintln!("superbot-sim: {fault}");
    }
    Ok(report.faults().is_empty())
}

fn scenario(options: &Sim) -> Result<Scenario, Box<dyn Error>> {
    match &options.robot {
        Source::Shape(shape) => {
            let modules = options.modules.unwrap_or(shape.usual_modules());
            let wiring = shape.wiring(modules).map_err(|error| format!("{error}; see --modules"))?;
            Ok(Scenario { wiring, timeline: Vec::new() })
        }
        Source::File(path) => {
            if options.modules.is_some() {
                return Err("the robot file says how many modules there are: leave --modules out".into());
            }
            let text = std::fs::read_to_string(path)
                .map_err(|error| format!("can't read {}: {error}", path.display()))?;
            Ok(Scenario::from_toml(&text).map_err(|error| format!("{}: {error}", path.display()))?)
        }
    }
}

fn load_images(directory: &Path) -> Result<Images, Box<dyn Error>> {
    let load = |name| Image::load(directory.join(name)).map(Arc::new);
    Ok(Images { master: load("firmware-master.elf")?, slave: load("firmware-slave.elf")? })
}

/// The images can be looked into, and serve all docks that the robot is joined by.
fn check_images(images: &Images, wiring: &Wiring) -> Result<(), String> {
    if images.master.symbol("MODULE_STATUS").is_none() {
        return Err("the master's image has no MODULE_STATUS: build both with `./x build`".into());
    }
    let has_link = |image: &Image| image.symbol(view::LINK_ON_PINS).is_some();
    let missing = || wiring.attached().find(|face| Module::is_on_pins(face.dock));
    match missing() {
        Some(face) if !has_link(&images.master) || !has_link(&images.slave) => Err(format!(
            "module {} is joined by its {:?} dock, for which the images have no link (no {}): build newer ones with \
             `./x build`, or run `./x sim chain`",
            face.module,
            face.dock,
            view::LINK_ON_PINS
        )),
        _ => Ok(()),
    }
}

fn build_robot(images: Images, wiring: &Wiring, options: &Sim) -> Result<Robot, Box<dyn Error>> {
    let builder = RobotBuilder::wired(images, wiring);
    let mut robot = builder.seed(options.seed).power_up_within(POWER_UP_WITHIN).build()?;
    robot.change(&Change::Loss { links: Links::All, probability: options.loss })?;
    Ok(robot)
}
