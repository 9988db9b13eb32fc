//! Measures a saturated module: the neighbours at all docks send as fast as they can, one of them asks the
//! module's console all the time, and a load pulls at the module's joints.

use simulation::Face;
use tasks::dock::Dock;

use super::control::{Control, TURN};
use super::{MEASURED, ModuleImages, SECOND, awake, expect_no_reset, load, module};
use crate::Controller;
use crate::bench::{BenchError, unmeasurable};
use crate::engine::Engine;
use crate::robot::RobotBuilder;

/// The results of saturation.
pub struct Saturated {
    /// The jitter of the joints' control, in cycles.
    pub jitter: u64,
    /// Periods of the joints' control that did not begin.
    pub missed: u64,
    pub cpu: f64,
    /// Bytes that the UARTs in software sent without a stop bit.
    pub framing_errors: u64,
}

/// The fewest messages that the console must take in a second, requests and answers.
const TAKEN: u64 = 10;

/// The messages that the console has taken.
fn taken(engine: &Engine) -> Result<u16, BenchError> {
    let counts = module(engine)?.mcu(Controller::Slave).read_symbol("CONSOLE");
    let counts = counts.map_err(|error| unmeasurable("firmware", error.to_string()))?;
    Ok(counts.first_chunk().copied().map_or(0, u16::from_le_bytes))
}

/// A module whose neighbours at all docks send as fast as they can. The one at Up runs `up`.
pub fn robot(images: &ModuleImages, up: &str) -> Result<RobotBuilder, BenchError> {
    // The modules in front and behind probe, so the module takes them for neighbours and is a spine. The
    // others do not probe.
    let robot = RobotBuilder::new(images.firmware()?, 7)
        .program(1, images.neighbour("flood_side", "flood_back")?)
        .program(2, images.neighbour("flood_front", "flood_side")?)
        .attach(Face { module: MEASURED, dock: Dock::Front }, Face { module: 1, dock: Dock::Back })
        .attach(Face { module: MEASURED, dock: Dock::Back }, Face { module: 2, dock: Dock::Front })
        .seed(1);
    at_sides(robot, images, up)
}

/// Adds neighbours that flood the module from all sides except front and back.
pub fn at_sides(
    mut robot: RobotBuilder,
    images: &ModuleImages,
    up: &str,
) -> Result<RobotBuilder, BenchError> {
    let sides =
        [(Dock::Left, "flood_side"), (Dock::Right, "flood_side"), (Dock::Up, up), (Dock::Down, "flood_side")];
    for (number, (dock, image)) in (3..).zip(sides) {
        robot = robot
            .program(number, images.neighbour(image, image)?)
            .attach(Face { module: MEASURED, dock }, Face { module: number, dock: Dock::Back });
    }
    Ok(robot)
}

/// Floods the module for `seconds` seconds.
pub fn measure(images: &ModuleImages, seconds: u64) -> Result<Saturated, BenchError> {
    // The console, on the slave, answers at Up. Its requests to the master cross the bridge.
    let robot = robot(images, "flood_console")?;
    let mut engine = Engine::new(robot.build()?, 1);
    engine.run_until(SECOND);
    let mut control = Control::watch(&mut engine);
    let before = awake(&engine)?;
    let taken_before = taken(&engine)?;
    let turns = seconds * SECOND / TURN;
    for _ in 0..turns {
        control.turn(&mut engine);
    }
    expect_no_reset(&engine)?;
    let taken = u64::from(taken(&engine)?.wrapping_sub(taken_before));
    if taken < seconds * TAKEN {
        return Err(unmeasurable(
            "firmware",
            format!("in {seconds} s its console took {taken} messages only"),
        ));
    }
    let rhythm = control.rhythm()?;
    let module = module(&engine)?;
    let framing_errors = Controller::ALL
        .into_iter()
        .filter_map(|mcu| Some(module.mcu(mcu).serial_pin_counts(0)?.framing_errors))
        .sum();
    Ok(Saturated {
        jitter: rhythm.jitter,
        missed: rhythm.missed,
        cpu: load(&engine, before, turns * TURN)?,
        framing_errors,
    })
}
