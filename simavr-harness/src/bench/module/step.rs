//! Measures a step of a module's joints.

use std::path::Path;

use plants::joint::Joint;
use simulation::Face;
use tasks::dock::Dock;
use tasks::motor::Axis;

use super::{
    MEASURED, MILLISECOND, ModuleImages, SECOND, awake, expect_no_reset, load, milliseconds, module,
};
use crate::bench::{BenchError, unmeasurable};
use crate::engine::Engine;
use crate::robot::RobotBuilder;

/// The results of a step of 30 degrees.
pub struct Step {
    pub overshoot_percent: f64,
    pub error: f64,
    /// The CPU's load once the joints are at rest.
    pub cpu: f64,
}

/// The joints of the module at one moment.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Time since power-up, in ms.
    pub ms: f64,
    /// By the indices of the joints.
    pub degrees: [f64; 3],
}

/// The angle of the joints at first, in degrees.
const START: f64 = 30.0;

/// The time after which the joints rest, in s.
const RESTS: u64 = 3;

/// Samples once a millisecond how the spine of a chain of three straightens, which begins bent by 30 degrees
/// at every joint. Runs the images in `directory`.
///
/// # Errors
/// An image is missing.
pub fn step_response(directory: &Path) -> Result<Vec<Sample>, BenchError> {
    follow(&ModuleImages { directory: directory.to_owned(), master: None }).map(|(_, samples)| samples)
}

pub fn measure(images: &ModuleImages) -> Result<Step, BenchError> {
    let (mut engine, samples) = follow(images)?;
    let swing = samples.iter().flat_map(|sample| sample.degrees).map(|degrees| -degrees).fold(0.0, f64::max);
    let end = samples.last().map(|sample| sample.degrees).unwrap_or_default();
    let error = end.into_iter().map(f64::abs).fold(0.0, f64::max);
    if error > START / 2.0 {
        return Err(unmeasurable("firmware-master", "the spine of a chain does not go straight"));
    }
    let before = awake(&engine)?;
    engine.run_until(engine.cycle() + 10 * SECOND);
    let cpu = load(&engine, before, 10 * SECOND)?;
    expect_no_reset(&engine)?;
    Ok(Step { overshoot_percent: swing / START * 100.0, error, cpu })
}

fn follow(images: &ModuleImages) -> Result<(Engine, Vec<Sample>), BenchError> {
    let face = |module, dock| Face { module, dock };
    let mut robot = RobotBuilder::new(images.firmware()?, 3)
        .attach(face(MEASURED, Dock::Front), face(1, Dock::Back))
        .attach(face(MEASURED, Dock::Back), face(2, Dock::Front))
        .seed(1)
        .build()?;
    if let Some(module) = robot.module_mut(MEASURED) {
        for axis in Axis::ALL {
            *module.body_mut().joint_mut(axis) = Joint::at(START);
        }
    }
    let mut engine = Engine::new(robot, 1);
    let mut samples = Vec::new();
    while engine.cycle() < RESTS * SECOND {
        engine.run_until(engine.cycle() + MILLISECOND);
        let body = module(&engine)?.body();
        let degrees = Axis::ALL.map(|axis| body.joint(axis).degrees());
        samples.push(Sample { ms: milliseconds(engine.cycle()), degrees });
    }
    Ok((engine, samples))
}
