//! The module's figures: what its joints do, what its lines carry, whether all is done in time while
//! everything else is busy, and how soon the module is itself again after a fault.

pub(super) mod babble;
mod bridge;
pub mod busy;
pub(super) mod control;
mod link;
mod recovery;
pub(super) mod saturated;
mod soft_uart;
pub(super) mod step;
mod watchdog;
mod weight;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;

use serde::Serialize;
use simulation::arq;

use super::{BenchError, unmeasurable};
use crate::Controller;
use crate::engine::Engine;
use crate::image::Image;
use crate::module::{Images, Module};
use crate::robot::RobotError;
use simulation::CLOCK_HZ;

pub use bridge::bridge_efficiency;
pub use link::link_efficiency;
pub use soft_uart::{SerialLoad, serial_load};
pub use step::{Sample, step_response};
pub use watchdog::watchdog_recovery;
pub use weight::{Weight, under_weight};

/// The figures of a module. Of two MCUs, and of several joints, the worse counts.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ModuleFigures {
    /// How much later a period of the joints' control begins than another, at most, in us, while the module
    /// is saturated. A period begins where it matters when it does: the last drives take effect, and the
    /// joints are measured for the next.
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
    /// Bytes that a UART in software got wrong, lost or sent wrongly, of a million and of those of the
    /// saturated module.
    pub soft_uart_errors: u64,
    /// What a link carries over the bound of stop-and-wait: on a good line,
    pub link_efficiency_0: f64,
    /// with one wrong bit in 10,000,
    pub link_efficiency_1e4: f64,
    /// and with one in 1,000.
    pub link_efficiency_1e3: f64,
    /// Of a million messages over links that lose 30 % of the frames each way, those that were lost without
    /// notice, came twice or out of turn. Without an MCU: the ARQ alone.
    pub link_violations: usize,
    /// What the bridge carries over what its wires can.
    pub bridge_efficiency: f64,
    /// Periods of the joints' control that did not begin while garbage came in at all docks,
    pub babble_pid_missed: u64,
    /// and how long after that the module was back in the robot at most, in ms.
    pub babble_recovery_ms: f64,
    /// How long it takes at most from a task's hanging, whichever it is, until the watchdog has its MCU back
    /// in the robot, in ms.
    pub watchdog_recovery_ms: f64,
    /// As `pid_jitter_us_max`, of all MCUs of a robot with six legs that walks in a world.
    pub walking_pid_jitter_us_max: f64,
    /// Periods of the joints' control that passed before the one before was done, then.
    pub walking_pid_missed: u64,
    /// How far a joint of its trunk is from its target once it stands on its legs, in degrees.
    pub standing_error_deg: f64,
}

pub(super) const SECOND: u64 = CLOCK_HZ as u64;
pub(super) const MILLISECOND: u64 = SECOND / 1000;

/// Cycles of a byte at 38400 baud, as the divisor makes them.
const BYTE: u64 = 4160;

/// The module that is measured: its neighbours follow.
pub(super) const MEASURED: usize = 0;

/// Bytes that the UARTs in software have to carry.
const SOFT_UART_BYTES: u64 = 1_000_000;

/// Measures the figures on the robot's images in `directory` and the test images in `tests/` below, saturated
/// for `seconds`.
///
/// # Errors
/// An image is not there, or does not do what is to be measured.
pub fn measure(directory: &Path, seconds: u64) -> Result<ModuleFigures, BenchError> {
    let images = &ModuleImages { directory: directory.to_owned(), master: None };
    let tests = &directory.join("tests");
    thread::scope(|scope| {
        let saturated = scope.spawn(move || saturated::measure(images, seconds));
        let serial = scope.spawn(move || serial_load(tests, SOFT_UART_BYTES));
        let links =
            [0.0, 1e-4, 1e-3].map(|bit_errors| scope.spawn(move || link_efficiency(tests, bit_errors)));
        let babble = scope.spawn(move || babble::measure(images));
        let watchdog = scope.spawn(move || watchdog_recovery(directory));
        let arq = scope.spawn(|| arq::million_at_loss(0.3));
        let weight = scope.spawn(move || under_weight(directory));
        let step = step::measure(images)?;
        let bridge_efficiency = bridge_efficiency(tests)?;
        let [link_efficiency_0, link_efficiency_1e4, link_efficiency_1e3] = links.map(join);
        let (saturated, serial, babble) = (join(saturated)?, join(serial)?, join(babble)?);
        let weight = join(weight)?;
        let microseconds = |cycles| cycles as f64 * 1e6 / f64::from(CLOCK_HZ);
        Ok(ModuleFigures {
            pid_jitter_us_max: microseconds(saturated.jitter),
            pid_missed: saturated.missed,
            step_overshoot_percent: step.overshoot_percent,
            step_error_deg: step.error,
            cpu_idle: step.cpu,
            cpu_saturated: saturated.cpu,
            soft_uart_errors: serial.soft_uart_errors + saturated.framing_errors,
            link_efficiency_0: link_efficiency_0?,
            link_efficiency_1e4: link_efficiency_1e4?,
            link_efficiency_1e3: link_efficiency_1e3?,
            link_violations: join(arq).violations.len(),
            bridge_efficiency,
            babble_pid_missed: babble.missed,
            babble_recovery_ms: milliseconds(babble.recovery),
            watchdog_recovery_ms: join(watchdog)?,
            walking_pid_jitter_us_max: microseconds(weight.jitter),
            walking_pid_missed: weight.missed,
            standing_error_deg: weight.error,
        })
    })
}

/// What a thread returns; its panic goes on here.
pub(super) fn join<T>(thread: thread::ScopedJoinHandle<'_, T>) -> T {
    thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

pub(super) fn milliseconds(cycles: u64) -> f64 {
    cycles as f64 / MILLISECOND as f64
}

/// Where the images lie.
pub(super) struct ModuleImages {
    /// Those of the firmware, and below, in `tests/`, those of neighbours.
    pub directory: PathBuf,
    /// The module's own master, in place of the firmware's.
    pub master: Option<PathBuf>,
}

impl ModuleImages {
    pub fn firmware(&self) -> Result<Images, BenchError> {
        let images = images(&self.directory, "firmware-master", "firmware-slave")?;
        Ok(match &self.master {
            Some(master) => Images { master: Arc::new(Image::load(master)?), ..images },
            None => images,
        })
    }

    /// A neighbour: the test images of its master and slave.
    pub fn neighbour(&self, master: &str, slave: &str) -> Result<Images, BenchError> {
        images(&self.directory.join("tests"), master, slave)
    }
}

/// The images of a module's MCUs.
fn images(directory: &Path, master: &str, slave: &str) -> Result<Images, BenchError> {
    let load = |name| Image::load(directory.join(name).with_extension("elf")).map(Arc::new);
    Ok(Images { master: load(master)?, slave: load(slave)? })
}

pub(super) fn module(engine: &Engine) -> Result<&Module, BenchError> {
    engine.robot().module(MEASURED).ok_or_else(|| unmeasurable("robot", "it has no module"))
}

/// Cycles that each MCU of the module was awake.
pub(super) fn awake(engine: &Engine) -> Result<[u64; 2], BenchError> {
    let module = module(engine)?;
    Ok(Controller::ALL.map(|mcu| module.mcu(mcu).awake_cycles()))
}

/// The share of `cycles` in which the busier MCU was awake, since it was so for `before`.
fn load(engine: &Engine, before: [u64; 2], cycles: u64) -> Result<f64, BenchError> {
    let now = awake(engine)?;
    let longest = now.into_iter().zip(before).map(|(now, before)| now - before).max();
    Ok(longest.unwrap_or(0) as f64 / cycles as f64)
}

/// A healthy module is never reset.
fn expect_no_reset(engine: &Engine) -> Result<(), BenchError> {
    let module = module(engine)?;
    match Controller::ALL.into_iter().find(|&mcu| module.mcu(mcu).resets() > 0) {
        None => Ok(()),
        Some(mcu) => {
            Err(unmeasurable("firmware", format!("the watchdog resets the {mcu:?} of a healthy module")))
        }
    }
}

impl From<RobotError> for BenchError {
    fn from(error: RobotError) -> Self {
        unmeasurable("robot", error.to_string())
    }
}
