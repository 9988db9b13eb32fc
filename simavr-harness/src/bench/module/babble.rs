//! Sends garbage at full baud to all six docks of a module, and measures how soon the module is back in the
//! robot after it ends.

use simulation::{Change, Face, Links, Random, Robot, WiringError};
use tasks::dock::Dock;

use super::control::{Control, TURN};
use super::recovery::recovery;
use super::{BYTE, MEASURED, ModuleImages, SECOND, expect_no_reset};
use crate::bench::{BenchError, unmeasurable};
use crate::character::Character;
use crate::engine::Engine;
use crate::robot::RobotBuilder;

/// The results of babble.
pub struct Babble {
    /// Periods of the joints' control that did not begin meanwhile.
    pub missed: u64,
    /// Cycles until the module was back in the robot.
    pub recovery: u64,
}

/// The fraction of zeros in the bytes of each run. A zero ends what may be a frame, and wakes the dock's
/// task. Uniformly random bytes have one zero in 256.
const ZEROS: [f64; 6] = [0.0, 1.0 / 256.0, 1.0 / 16.0, 0.25, 0.5, 1.0];

/// The length of the babble, in turns of the joints' load.
const TURNS: u64 = 25;

/// Sends babble to the spine of a chain of three, several times; the worst result counts.
pub fn measure(images: &ModuleImages) -> Result<Babble, BenchError> {
    let mut worst = Babble { missed: 0, recovery: 0 };
    for (seed, zeros) in (1..).zip(ZEROS) {
        let Babble { missed, recovery } = run(images, seed, zeros)?;
        worst = Babble { missed: worst.missed.max(missed), recovery: worst.recovery.max(recovery) };
    }
    Ok(worst)
}

/// One run. Each ends at another time between two beats of the head.
fn run(images: &ModuleImages, seed: u64, zeros: f64) -> Result<Babble, BenchError> {
    let neighbours = [Face { module: 1, dock: Dock::Back }, Face { module: 2, dock: Dock::Front }];
    let robot = RobotBuilder::new(images.firmware()?, 3)
        .attach(Face { module: MEASURED, dock: Dock::Front }, neighbours[0])
        .attach(Face { module: MEASURED, dock: Dock::Back }, neighbours[1])
        .seed(seed);
    let mut engine = Engine::new(robot.build()?, 1);
    engine.run_until(2 * SECOND + seed * SECOND / 2 / ZEROS.len() as u64);
    drown(&mut engine, neighbours, 1.0)?;
    let mut random = Random::new(seed);
    babble(&mut engine, &mut random, zeros);
    let mut control = Control::watch(&mut engine);
    for _ in 0..TURNS {
        babble(&mut engine, &mut random, zeros);
        control.turn(&mut engine);
    }
    drown(&mut engine, neighbours, 0.0)?;
    let babble = Babble { missed: control.rhythm()?.missed, recovery: recovery(&mut engine, |_| true)? };
    expect_no_reset(&engine)?;
    Ok(babble)
}

/// Sets the probability that a frame from the neighbours to the module is lost: 1 for babble, 0 after it.
pub fn drown(engine: &mut Engine, neighbours: [Face; 2], probability: f64) -> Result<(), BenchError> {
    for face in neighbours {
        let change = Change::Loss { links: Links::From(face), probability };
        engine.change(&change).map_err(|error: WiringError| unmeasurable("robot", error.to_string()))?;
    }
    Ok(())
}

/// Delivers the garbage of a turn to all docks, at the full rate. `zeros` is the fraction of zeros.
pub fn babble(engine: &mut Engine, random: &mut Random, zeros: f64) {
    let now = engine.cycle();
    let Some(module) = engine.robot_mut().module_mut(MEASURED) else { return };
    for (phase, dock) in (1..).zip(Dock::ALL) {
        let mut start = now + phase * BYTE / 7;
        while start + BYTE <= now + TURN {
            let value = if random.chance(zeros) { 0 } else { 1 + random.below(255) as u8 };
            module.receive(dock, Character { value, start, end: start + BYTE });
            start += BYTE;
        }
    }
}
