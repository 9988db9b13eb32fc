//! A step of a module's joints.

use plants::joint::Joint;
use simulation::Face;
use tasks::dock::Dock;
use tasks::motor::Axis;

use super::{MEASURED, MILLISECOND, ModuleImages, SECOND, awake, expect_no_reset, load, module};
use crate::bench::{BenchError, unmeasurable};
use crate::engine::Engine;
use crate::robot::RobotBuilder;

/// What comes of a step of 30 degrees.
pub struct Step {
    pub overshoot_percent: f64,
    pub error: f64,
    /// The CPU's load once the joints are at rest.
    pub cpu: f64,
}

/// The spine of a chain of three begins bent by 30 degrees at every joint, and goes straight.
pub fn measure(images: &ModuleImages) -> Result<Step, BenchError> {
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
    expect_no_reset(&engine)?;
    Ok(Step { overshoot_percent: swing / START * 100.0, error, cpu })
}
