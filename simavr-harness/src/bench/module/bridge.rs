//! Measures the throughput of the bridge between a module's MCUs.

use std::path::Path;

use super::link::{in_turn, word};
use super::{MEASURED, MILLISECOND, SECOND, images, module};
use crate::Controller;
use crate::bench::{BenchError, unmeasurable};
use crate::engine::Engine;
use crate::robot::RobotBuilder;

/// Cycles that a message of 16 bytes takes on the wire at 400 kHz: START, address, 20 bytes with an
/// acknowledgement each, STOP.
const WIRE: u64 = (1 + 21 * 9 + 1) * SECOND / 400_000;

/// The bridge's throughput in a second, as a fraction of what the wires can carry. A master sends messages to
/// its slave as fast as the bridge takes them. The test images `bench_bridge_*` are in `directory`.
///
/// # Errors
/// An image is missing, or a message is lost.
pub fn bridge_efficiency(directory: &Path) -> Result<f64, BenchError> {
    let images = images(directory, "bench_bridge_a", "bench_bridge_b")?;
    let mut engine = Engine::new(RobotBuilder::new(images, MEASURED + 1).seed(1).build()?, 1);
    engine.run_until(100 * MILLISECOND);
    let before = in_turn(module(&engine)?.mcu(Controller::Slave))?;
    engine.run_until(engine.cycle() + SECOND);
    let slave = module(&engine)?.mcu(Controller::Slave);
    if word(slave, "OUT_OF_TURN")? != 0 {
        return Err(unmeasurable("bench_bridge_b", "a message is missing"));
    }
    Ok(f64::from(in_turn(slave)?.wrapping_sub(before)) * WIRE as f64 / SECOND as f64)
}
