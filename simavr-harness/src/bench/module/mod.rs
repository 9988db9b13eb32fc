//! The module's figures: the motion of its joints, the throughput of its lines, whether deadlines are met
//! while everything is busy, and how soon the module recovers after a fault.

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

/// The figures of a module. Of two MCUs, and of several joints, the worst value counts.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ModuleFigures {
    /// From the earliest to the latest begin within a period of the joints' control, in us, while the module
    /// is saturated. The begin of a period is the instant that counts: the last drives take effect, and the
    /// joints are measured for the next ones.
    pub pid_jitter_us_max: f64,
    /// Periods of the joints' control that did not begin while the module was saturated.
    pub pid_missed: u64,
    /// The overshoot of a joint on a step of 30 degrees, in percent of the step.
    pub step_overshoot_percent: f64,
    /// The distance of a joint from its target at the end of the step, in degrees.
    pub step_error_deg: f64,
    /// The fraction of time in which the CPU is awake, in the middle of a chain whose joints are at rest.
    pub cpu_idle: f64,
    /// The fraction of time in which the CPU is awake while the module is saturated.
    pub cpu_saturated: f64,
    /// Bytes that a UART in software received wrongly, lost or sent wrongly, of a million and of those of the
    /// saturated module.
    pub soft_uart_errors: u64,
    /// A link's throughput as a fraction of the bound of stop-and-wait, on a good line.
    pub link_efficiency_0: f64,
    /// The same with one wrong bit in 10,000.
    pub link_efficiency_1e4: f64,
    /// The same with one wrong bit in 1,000.
    pub link_efficiency_1e3: f64,
    /// The messages that were lost without notice, came twice or came out of turn, of a million over links
    /// that lose 30 % of the frames each way. Measured on the ARQ alone, without an MCU.
    pub link_violations: usize,
    /// The bridge's throughput as a fraction of what its wires can carry.
    pub bridge_efficiency: f64,
    /// Periods of the joints' control that did not begin while garbage came in at all docks.
    pub babble_pid_missed: u64,
    /// The longest time after that garbage until the module was back in the robot, in ms.
    pub babble_recovery_ms: f64,
    /// The longest time from the hanging of any task until the watchdog has brought its MCU back into the
    /// robot, in ms.
    pub watchdog_recovery_ms: f64,
    /// As `pid_jitter_us_max`, for all MCUs of a robot with six legs that walks in a world.
    pub walking_pid_jitter_us_max: f64,
    /// Periods of the joints' control that passed before the one before was done, while that robot walks.
    pub walking_pid_missed: u64,
    /// The distance of a joint of its trunk from the target once the robot stands on its legs, in degrees.
    pub standing_error_deg: f64,
}

pub(super) const SECOND: u64 = CLOCK_HZ as u64;
pub(super) const MILLISECOND: u64 = SECOND / 1000;

/// Cycles of a byte at 38400 baud, by the baud rate divisor.
const BYTE: u64 = 4160;

/// The number of the module that is measured. Its neighbours have the next numbers.
pub(super) const MEASURED: usize = 0;

/// Bytes that the UARTs in software have to carry.
const SOFT_UART_BYTES: u64 = 1_000_000;

/// Measures the figures on the robot's images in `directory` and the test images in its `tests/`. The module
/// is saturated for `seconds`.
///
/// # Errors
/// An image is missing, or does not do what is to be measured.
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

/// The result of a thread. A panic of the thread is resumed here.
pub(super) fn join<T>(thread: thread::ScopedJoinHandle<'_, T>) -> T {
    thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

pub(super) fn milliseconds(cycles: u64) -> f64 {
    cycles as f64 / MILLISECOND as f64
}

/// The places of the images.
pub(super) struct ModuleImages {
    /// The directory of the firmware's images, with those of neighbours in `tests/` below it.
    pub directory: PathBuf,
    /// The image of the module's master, in place of the firmware's.
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

/// The fraction of the last `cycles` in which the busier MCU was awake. `before` has the awake cycles at
/// their begin.
fn load(engine: &Engine, before: [u64; 2], cycles: u64) -> Result<f64, BenchError> {
    let now = awake(engine)?;
    let longest = now.into_iter().zip(before).map(|(now, before)| now - before).max();
    Ok(longest.unwrap_or(0) as f64 / cycles as f64)
}

/// Checks that no MCU of the module was reset, as none of a healthy one is.
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
