//! The module's figures: what its joints do, and whether they are controlled in time while everything else is busy.

use std::path::Path;
use std::sync::Arc;

use plants::joint::Joint;
use serde::Serialize;
use simulation::Face;
use tasks::dock::Dock;
use tasks::motor::Axis;

use super::{BenchError, unmeasurable};
use crate::engine::Engine;
use crate::image::Image;
use crate::mcu::{CLOCK_HZ, Pin};
use crate::module::{Controller, Images, Module};
use crate::probe::Edge;
use crate::robot::{RobotBuilder, RobotError};

/// The figures of a module. Of two MCUs, and of several joints, the worse counts.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ModuleFigures {
    /// How much later a period of the joints' control begins than another, at most, in us, while the module is saturated. A
    /// period begins where it matters when it does: the last drives take effect, and the joints are measured for the next.
    pub pid_jitter_us_max: f64,
    /// Periods in which it did not begin, then.
    pub pid_missed: u64,
    /// How far a joint swings beyond its target on a step of 30 degrees, in percent of that.
    pub step_overshoot_percent: f64,
    /// How far it is from the target in the end, in degrees.
    pub step_error_deg: f64,
    /// The fraction of time in which the CPU is awake: in the middle of a chain whose joints are at rest,
    pub cpu_idle: f64,
    /// and saturated.
    pub cpu_saturated: f64,
}

const SECOND: u64 = CLOCK_HZ as u64;
const MILLISECOND: u64 = SECOND / 1000;

/// Cycles of a period of the joints' control.
const PERIOD: u64 = MILLISECOND;

/// The module that is measured: its neighbours follow.
const MEASURED: usize = 0;

/// The pin that is high while the joints' control computes.
const CONTROL: Pin = Pin { port: 'B', bit: 4 };

/// Measures the figures on the robot's images in `directory` and the test images in `tests/` below, saturated for
/// `seconds`.
///
/// # Errors
/// An image is not there, or does not do what is to be measured.
pub fn measure(directory: &Path, seconds: u64) -> Result<ModuleFigures, BenchError> {
    let images = ModuleImages { directory };
    let step = step(&images)?;
    let saturated = saturated(&images, seconds)?;
    Ok(ModuleFigures {
        pid_jitter_us_max: saturated.jitter as f64 * 1e6 / f64::from(CLOCK_HZ),
        pid_missed: saturated.missed,
        step_overshoot_percent: step.overshoot_percent,
        step_error_deg: step.error,
        cpu_idle: step.cpu,
        cpu_saturated: saturated.cpu,
    })
}

/// The directory with the images.
struct ModuleImages<'a> {
    directory: &'a Path,
}

impl ModuleImages<'_> {
    fn load(&self, name: &str) -> Result<Arc<Image>, BenchError> {
        Ok(Arc::new(Image::load(self.directory.join(name).with_extension("elf"))?))
    }

    fn firmware(&self) -> Result<Images, BenchError> {
        Ok(Images { master: self.load("firmware-master")?, slave: self.load("firmware-slave")? })
    }

    /// A neighbour: the test images of its master and slave.
    fn neighbour(&self, master: &str, slave: &str) -> Result<Images, BenchError> {
        Ok(Images {
            master: self.load(&format!("tests/{master}"))?,
            slave: self.load(&format!("tests/{slave}"))?,
        })
    }
}

fn module(engine: &Engine) -> Result<&Module, BenchError> {
    engine.robot().module(MEASURED).ok_or_else(|| unmeasurable("robot", "it has no module"))
}

/// Cycles that each MCU of the module was awake.
fn awake(engine: &Engine) -> Result<[u64; 2], BenchError> {
    let module = module(engine)?;
    Ok(Controller::ALL.map(|mcu| module.mcu(mcu).awake_cycles()))
}

/// The share of `cycles` in which the busier MCU was awake, since it was so for `before`.
fn load(engine: &Engine, before: [u64; 2], cycles: u64) -> Result<f64, BenchError> {
    let now = awake(engine)?;
    let longest = now.into_iter().zip(before).map(|(now, before)| now - before).max();
    Ok(longest.unwrap_or(0) as f64 / cycles as f64)
}

// --- A step -------------------------------------------------------------------------------------

/// What comes of a step of 30 degrees.
struct Step {
    overshoot_percent: f64,
    error: f64,
    /// The CPU's load once the joints are at rest.
    cpu: f64,
}

/// The spine of a chain of three begins bent by 30 degrees at every joint, and goes straight.
fn step(images: &ModuleImages) -> Result<Step, BenchError> {
    const START: f64 = 30.0;
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
    let mut swing: f64 = 0.0;
    while engine.cycle() < 3 * SECOND {
        engine.run_until(engine.cycle() + MILLISECOND);
        let body = module(&engine)?.body();
        swing = Axis::ALL.into_iter().map(|axis| -body.joint(axis).degrees()).fold(swing, f64::max);
    }
    let body = module(&engine)?.body();
    let error = Axis::ALL.into_iter().map(|axis| body.joint(axis).degrees().abs()).fold(0.0, f64::max);
    if error > START / 2.0 {
        return Err(unmeasurable("firmware-master", "the spine of a chain does not go straight"));
    }
    let before = awake(&engine)?;
    engine.run_until(engine.cycle() + 10 * SECOND);
    let cpu = load(&engine, before, 10 * SECOND)?;
    Ok(Step { overshoot_percent: swing / START * 100.0, error, cpu })
}

// --- Saturated ----------------------------------------------------------------------------------

/// What comes of a flood.
struct Saturated {
    /// In cycles.
    jitter: u64,
    missed: u64,
    cpu: f64,
}

/// What pulls at the joints, in Nm, to and fro: more than friction, and turned so often that they are never at rest.
const PULL: f64 = 3.0;

/// How often that is turned, in cycles.
const TURN: u64 = 80 * MILLISECOND;

/// A module whose neighbours at all docks send as fast as they can, while something pulls at its joints.
fn saturated(images: &ModuleImages, seconds: u64) -> Result<Saturated, BenchError> {
    // Those in front and behind are neighbours to the module, which so is a spine. The others do not probe.
    let mut robot = RobotBuilder::new(images.firmware()?, 7)
        .program(1, images.neighbour("flood_side", "flood_back")?)
        .program(2, images.neighbour("flood_front", "flood_side")?)
        .attach(Face { module: MEASURED, dock: Dock::Front }, Face { module: 1, dock: Dock::Back })
        .attach(Face { module: MEASURED, dock: Dock::Back }, Face { module: 2, dock: Dock::Front })
        .seed(1);
    for (number, dock) in (3..).zip([Dock::Left, Dock::Right, Dock::Up, Dock::Down]) {
        robot = robot
            .program(number, images.neighbour("flood_side", "flood_side")?)
            .attach(Face { module: MEASURED, dock }, Face { module: number, dock: Dock::Back });
    }
    let mut engine = Engine::new(robot.build()?, 1);
    engine.run_until(SECOND);
    pull(&mut engine, PULL);
    engine.run_until(engine.cycle() + TURN);
    for mcu in Controller::ALL {
        if let Some(module) = engine.robot_mut().module_mut(MEASURED) {
            module.mcu_mut(mcu).add_probe(CONTROL);
        }
    }
    let before = awake(&engine)?;
    let mut begins = [Vec::new(), Vec::new()];
    let turns = seconds * SECOND / TURN;
    for turn in 0..turns {
        pull(&mut engine, if turn % 2 == 0 { -PULL } else { PULL });
        engine.run_until(engine.cycle() + TURN);
        if let Some(module) = engine.robot_mut().module_mut(MEASURED) {
            for (mcu, begins) in Controller::ALL.into_iter().zip(&mut begins) {
                let edges = module.mcu_mut(mcu).take_edges(0);
                begins.extend(edges.into_iter().filter(|edge: &Edge| edge.level).map(|edge| edge.cycle));
            }
        }
    }
    let cycles = turns * TURN;
    let (mut jitter, mut missed) = (0, 0);
    for begins in &begins {
        let rhythm = Rhythm::of(begins)
            .ok_or_else(|| unmeasurable("firmware-master", "its joints are not controlled"))?;
        jitter = jitter.max(rhythm.jitter);
        missed = missed.max((cycles / PERIOD).saturating_sub(rhythm.periods));
    }
    Ok(Saturated { jitter, missed, cpu: load(&engine, before, cycles)? })
}

/// Pulls at all joints of the module, in Nm.
fn pull(engine: &mut Engine, torque: f64) {
    if let Some(module) = engine.robot_mut().module_mut(MEASURED) {
        for axis in Axis::ALL {
            module.body_mut().joint_mut(axis).surroundings.load_torque = torque;
        }
    }
}

/// How well the control keeps time.
struct Rhythm {
    /// From the earliest to the latest begin within a period, in cycles.
    jitter: u64,
    /// Periods that begin.
    periods: u64,
}

impl Rhythm {
    /// `None` without any begin.
    fn of(begins: &[u64]) -> Option<Rhythm> {
        let first = *begins.first()?;
        // From the nearest multiple of a period after the first.
        let offsets = || {
            begins.iter().map(|begin| {
                let nearest = (begin - first + PERIOD / 2) / PERIOD * PERIOD;
                (begin - first) as i64 - nearest as i64
            })
        };
        Some(Rhythm { jitter: offsets().max()?.abs_diff(offsets().min()?), periods: begins.len() as u64 })
    }
}

impl From<RobotError> for BenchError {
    fn from(error: RobotError) -> Self {
        unmeasurable("robot", error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jitter_is_from_the_earliest_to_the_latest() {
        let rhythm = |begins: &[u64]| Rhythm::of(begins).map(|rhythm| (rhythm.jitter, rhythm.periods));
        assert_eq!(rhythm(&[]), None);
        assert_eq!(rhythm(&[100, 16_100, 32_100]), Some((0, 3)));
        assert_eq!(rhythm(&[100, 16_400, 32_050]), Some((350, 3)));
        assert_eq!(rhythm(&[100, 48_110, 64_100]), Some((10, 3)));
    }
}
