//! Loads every serial line and the bus as much as possible, on two modules joined at all docks.

use std::path::Path;

use simulation::Face;
use tasks::dock::Dock;

use super::{MILLISECOND, images};
use crate::Controller;
use crate::bench::{BenchError, unmeasurable};
use crate::engine::Engine;
use crate::module::Images;
use crate::robot::RobotBuilder;

/// The load that the lines carried.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SerialLoad {
    /// Bytes that arrived correctly on the lines in software.
    pub soft_uart_bytes: u64,
    /// Frames that came wrong there, bytes lost on the way in, and bytes sent without a stop bit.
    pub soft_uart_errors: u64,
    /// Frames that came wrong, and bytes lost, on the other lines and the bus.
    pub other_errors: u64,
}

/// The variables in which the test image counts arrivals: on the line in software, and on the others.
const SOFT_UART: &str = "FOR_SOFT_UART";
const OTHERS: [&str; 3] = ["FOR_USART0", "FOR_USART1", "FOR_BUS"];

/// The number of runs, each with other contents of the memories at power-up.
const SEEDS: u64 = 4;

/// Loads the lines until `bytes` bytes have arrived on the lines in software, over all MCUs. The test images
/// `board_serial_*` are in `directory`.
///
/// # Errors
/// An image is missing, or nothing arrives.
pub fn serial_load(directory: &Path, bytes: u64) -> Result<SerialLoad, BenchError> {
    let images = images(directory, "board_serial_a", "board_serial_b")?;
    let mut all = SerialLoad::default();
    for seed in 1..=SEEDS {
        all = all.plus(run(&images, seed, bytes / SEEDS)?);
    }
    Ok(all)
}

/// Runs until `bytes` bytes have arrived.
fn run(images: &Images, seed: u64, bytes: u64) -> Result<SerialLoad, BenchError> {
    let join = |robot: RobotBuilder, dock| robot.attach(Face { module: 0, dock }, Face { module: 1, dock });
    let robot = Dock::ALL.into_iter().fold(RobotBuilder::new(images.clone(), 2).seed(seed), join);
    let mut engine = Engine::new(robot.build()?, 1);
    // Ends that send at the same time do not hear each other; it takes a while until they take turns.
    engine.run_until(500 * MILLISECOND);
    let start = SerialLoad::of(&engine)?;
    let mut load = SerialLoad::default();
    while load.soft_uart_bytes < bytes {
        engine.run_until(engine.cycle() + 100 * MILLISECOND);
        let before = load.soft_uart_bytes;
        load = SerialLoad::of(&engine)?.since(start);
        if load.soft_uart_bytes == before {
            return Err(unmeasurable("board_serial_a", "its bytes no longer arrive"));
        }
    }
    Ok(load)
}

impl SerialLoad {
    /// The counts of all MCUs.
    fn of(engine: &Engine) -> Result<Self, BenchError> {
        let mut load = SerialLoad::default();
        for module in (0..engine.robot().modules()).filter_map(|index| engine.robot().module(index)) {
            for mcu in Controller::ALL.map(|controller| module.mcu(controller)) {
                let count = |line| {
                    let bytes = mcu.read_symbol(line).ok();
                    bytes.and_then(|bytes| Counts::read(&bytes)).ok_or_else(|| {
                        unmeasurable("board_serial_a", format!("it has no {line}; build it with ./x bench"))
                    })
                };
                let soft = count(SOFT_UART)?;
                load.soft_uart_bytes += soft.right;
                load.soft_uart_errors += soft.errors;
                load.soft_uart_errors += mcu.serial_pin_counts(0).map_or(0, |pins| pins.framing_errors);
                for line in OTHERS {
                    load.other_errors += count(line)?.errors;
                }
            }
        }
        Ok(load)
    }

    fn plus(self, other: Self) -> Self {
        SerialLoad {
            soft_uart_bytes: self.soft_uart_bytes + other.soft_uart_bytes,
            soft_uart_errors: self.soft_uart_errors + other.soft_uart_errors,
            other_errors: self.other_errors + other.other_errors,
        }
    }

    fn since(self, start: Self) -> Self {
        SerialLoad {
            soft_uart_bytes: self.soft_uart_bytes - start.soft_uart_bytes,
            soft_uart_errors: self.soft_uart_errors - start.soft_uart_errors,
            other_errors: self.other_errors - start.other_errors,
        }
    }
}

/// The arrivals on a line of an MCU.
struct Counts {
    right: u64,
    errors: u64,
}

impl Counts {
    /// Reads the bytes that arrived correctly, the wrong frames and the bytes lost: little-endian, of 4, 2
    /// and 2 bytes.
    fn read(bytes: &[u8]) -> Option<Self> {
        let &[a, b, c, d, e, f, g, h] = bytes else { return None };
        let [wrong, lost] = [[e, f], [g, h]].map(u16::from_le_bytes);
        Some(Counts {
            right: u32::from_le_bytes([a, b, c, d]).into(),
            errors: u64::from(wrong) + u64::from(lost),
        })
    }
}
