//! `./x sim`: runs a robot, shows it live, and says how it did.

use std::error::Error;
use std::io::IsTerminal;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use hormone::gait::GaitName;
use simavr_harness::{Engine, Faults, Image, Images, Module, Robot, RobotBuilder, Wiring};
use simulation::{MILLISECOND, Observer};

use super::arguments::Sim;
use super::display::Display;
use super::report::Report;
use super::{json, view};

/// Returns whether the robot did as it should.
pub fn run(options: &Sim) -> Result<bool, Box<dyn Error>> {
    let shape = options.shape.shape();
    let wiring = shape.wiring(options.modules.unwrap_or(shape.usual_modules()))?;
    let images = load_images(&options.images)?;
    check_links(&images, &wiring)?;
    let robot = build_robot(images, &wiring, options)?;
    let mut engine = Engine::new(robot, options.threads);
    let mut observer = Observer::new(&engine, u64::from(GaitName::Centipede.gait().period()) * MILLISECOND);
    let mut display = Display::new(options.json.is_none() || std::io::stderr().is_terminal());
    let end = (options.seconds * 1000.0 * MILLISECOND as f64) as u64;
    let started = Instant::now();
    while engine.cycle() < end {
        engine.run_until((engine.cycle() + Observer::STEP).min(end));
        observer.look(&mut engine);
        display.show(&engine, &observer, end, started.elapsed())?;
    }
    display.finish();
    let report = Report::new(options, &engine, &observer, started.elapsed())?;
    match &options.json {
        Some(path) => json::write(&report, path)?,
        None => print!("{report}"),
    }
    for fault in report.faults() {
        eprintln!("superbot-sim: {fault}");
    }
    Ok(report.faults().is_empty())
}

fn load_images(directory: &Path) -> Result<Images, Box<dyn Error>> {
    let load = |name| Image::load(directory.join(name)).map(Arc::new);
    Ok(Images { master: load("firmware-master.elf")?, slave: load("firmware-slave.elf")? })
}

/// The images serve all docks that the robot is joined by.
fn check_links(images: &Images, wiring: &Wiring) -> Result<(), String> {
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
    let mut robot = RobotBuilder::wired(images, wiring).seed(options.seed).build()?;
    for face in wiring.attached() {
        robot.set_faults(face, Faults { frame_loss: options.loss, ..Faults::default() });
    }
    Ok(robot)
}
