//! Measures joints that bear the body: a robot with six legs walks on the ground of a world, then stands.

use std::path::Path;

use simulation::{Change, Face, Shape};
use tasks::dock::Dock;
use world::Ground;

use super::control::jitter;
use super::{ModuleImages, SECOND};
use crate::Controller;
use crate::bench::{BenchError, unmeasurable};
use crate::counters;
use crate::engine::Engine;
use crate::mcu::Mcu;
use crate::module::CONTROL_PROBE;
use crate::probe::Edge;
use crate::robot::RobotBuilder;

/// The results for joints under the body's weight.
pub struct Weight {
    /// The jitter of their control while the robot walks, in cycles, of the MCU with the largest.
    pub jitter: u64,
    /// Periods that passed before the one before was done, while the robot walks, of all MCUs.
    pub missed: u64,
    /// The distance of a joint of the trunk from its target while the robot stands on its legs, in degrees.
    pub error: f64,
}

/// Head, three branches with two legs each, tail.
const MODULES: usize = 11;

/// The modules that the rules hold straight: the head and the branches.
const TRUNK: [usize; 4] = [0, 1, 4, 7];

/// The cycle from which the robot is watched as it walks, and the cycles for which it walks and then stands.
const START: u64 = 3 * SECOND;
const WALK: u64 = 10 * SECOND;
const STAND: u64 = 8 * SECOND;

/// An order to stop: gait 0, the remote control's first order, the gait's own Period.
const STOP: [u8; 3] = [0xd0, 1, 255];

/// Measures on the images in `directory`.
///
/// # Errors
/// An image is missing, or is not one of the robot's.
pub fn under_weight(directory: &Path) -> Result<Weight, BenchError> {
    let images = ModuleImages { directory: directory.to_owned(), master: None };
    let wiring = Shape::SixLegs.wiring(MODULES).map_err(|error| unmeasurable("robot", error.to_string()))?;
    let robot = RobotBuilder::wired(images.firmware()?, &wiring).seed(1).on(Ground::default());
    let mut engine = Engine::new(robot.build()?, 1);
    engine.run_until(START);
    each_mcu(&mut engine, |mcu| mcu.add_probe(CONTROL_PROBE));
    let before = missed(&mut engine)?;
    engine.run_until(START + WALK);
    let jitters = each_mcu(&mut engine, |mcu| jitter(&begins(mcu)));
    let missed = missed(&mut engine)? - before;
    let stop = Change::Command { at: Face { module: 0, dock: Dock::Front }, payload: STOP.to_vec() };
    engine.robot_mut().change(&stop).map_err(|error| unmeasurable("robot", error.to_string()))?;
    engine.run_until(engine.cycle() + STAND);
    let angles = |module| engine.robot().module(module).map(|module| module.body().angles());
    let error = TRUNK.into_iter().filter_map(angles).flatten().map(f64::abs).fold(0.0, f64::max);
    Ok(Weight { jitter: jitters.into_iter().max().unwrap_or(0), missed, error })
}

/// The cycles at which the periods of an MCU's control began, since its probe was last read.
fn begins(mcu: &mut Mcu) -> Vec<u64> {
    mcu.take_edges(0).into_iter().filter(|edge| edge.level).map(|Edge { cycle, .. }| cycle).collect()
}

/// The periods that were missed since power-up, of all MCUs.
fn missed(engine: &mut Engine) -> Result<u64, BenchError> {
    let counts = each_mcu(engine, |mcu| counters::motors(mcu).map(|counters| u64::from(counters.missed)));
    counts.into_iter().sum::<Option<u64>>().ok_or_else(|| unmeasurable("firmware", "it has no MOTORS"))
}

/// The results of `ask` for each MCU of the robot.
fn each_mcu<T>(engine: &mut Engine, mut ask: impl FnMut(&mut Mcu) -> T) -> Vec<T> {
    let mut answers = Vec::new();
    for number in 0..MODULES {
        let Some(module) = engine.robot_mut().module_mut(number) else { continue };
        answers.extend(Controller::ALL.map(|mcu| ask(module.mcu_mut(mcu))));
    }
    answers
}
