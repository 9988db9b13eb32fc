//! Measures a busy module: how long its control of the joints takes, and how long interrupts wait, while
//! bytes come in at all docks without a pause and a load pulls at the joints.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use simulation::{Change, Face, Links, Random, Robot};
use tasks::dock::Dock;
use tasks::link::cobs::WireBuffer;
use tasks::link::frame::{Frame, Label, Turn};
use tasks::link::signature::Signature;
use tasks::message::{MAX_PAYLOAD, TaskCode};

use super::control::{PULL, offsets, pull};
use super::{BYTE, MEASURED, MILLISECOND, ModuleImages, SECOND};
use crate::Controller;
use crate::bench::{BenchError, unmeasurable};
use crate::character::Character;
use crate::engine::Engine;
use crate::mcu::Mcu;
use crate::module::CONTROL_PROBE;
use crate::probe::Edge;
use crate::robot::RobotBuilder;
use crate::trace::Trace;

/// The bytes that come in at all docks, without a pause.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Load {
    /// Messages whose bits alternate, as many as a line carries.
    Alternating,
    /// Frames of random kinds, lengths and contents, as many as a line carries.
    Frames,
    /// Random bytes, one in four a zero.
    Babble,
    /// Only the bytes that end a frame.
    Zeros,
}

impl fmt::Display for Load {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Load::Alternating => "alternating",
            Load::Frames => "frames",
            Load::Babble => "babble",
            Load::Zeros => "zeros",
        })
    }
}

/// The longest times on one MCU, in cycles.
pub struct Seen {
    pub controller: Controller,
    /// By load, the time from when a period of the joints' control is due, to within some 60 cycles, until
    /// its drives are computed.
    pub control: Vec<(Load, u64)>,
    /// The time that an interrupt waits, by its vector: the interrupts of periodic timers, and the receive
    /// interrupts of both USARTs.
    pub waited: BTreeMap<u8, u64>,
}

/// How long each [`Load`] usually lasts, in s.
pub const SECONDS: u64 = 2;

/// The time for which the load pulls at the joints in one direction.
const TURN: u64 = 50 * MILLISECOND;

/// The fewest periods of the joints' control that each load must have.
const PERIODS: usize = 100;

/// The serial ports of an MCU: the third is the one in software.
const PORTS: usize = 3;

/// The interrupts whose waiting is measured: that of the rounds of measurement, that of the tick, and the
/// receive interrupt of each USART.
const ROUND: u8 = 9;
const TICK: u8 = 15;
const RECEIVED: [u8; 2] = [18, 30];

/// The characters that came in, each with its MCU and serial port.
type Came = Vec<(Controller, usize, Character)>;

/// Measures a module, with the images in `directory`, under each load for so many seconds, at least 1.
///
/// # Errors
/// An image is missing, or does not control its joints.
pub fn measure(directory: &Path, seconds: u64) -> Result<[Seen; 2], BenchError> {
    let mut engine = walking(directory)?;
    let (mut random, mut came) = (Random::new(1), Came::new());
    pull(&mut engine, PULL);
    engine.run_until(engine.cycle() + TURN);
    for controller in Controller::ALL {
        mcu(&mut engine, controller)?.add_probe(CONTROL_PROBE);
    }
    let start = engine.cycle();
    let mut seen =
        Controller::ALL.map(|controller| Seen { controller, control: Vec::new(), waited: BTreeMap::new() });
    for load in [Load::Alternating, Load::Frames, Load::Babble, Load::Zeros] {
        for turn in 0..seconds * SECOND / TURN {
            pull(&mut engine, if turn % 2 == 0 { -PULL } else { PULL });
            come_in(&mut engine, load, &mut random, &mut came)?;
            engine.run_until(engine.cycle() + TURN);
        }
        for seen in &mut seen {
            let edges = mcu(&mut engine, seen.controller)?.take_edges(0);
            seen.control.push((load, longest(&edges)?));
        }
    }
    for seen in &mut seen {
        let trace = mcu(&mut engine, seen.controller)?.take_trace();
        let trace = trace.ok_or_else(|| unmeasurable("firmware", "it was not traced"))?;
        seen.waited = waited(&trace, &came, seen.controller, start);
    }
    Ok(seen)
}

/// A module that walks, and no longer hears the neighbour behind it.
fn walking(directory: &Path) -> Result<Engine, BenchError> {
    let images = ModuleImages { directory: directory.to_owned(), master: None };
    let [here, there] =
        [(MEASURED, Dock::Back), (1, Dock::Front)].map(|(module, dock)| Face { module, dock });
    let robot = RobotBuilder::new(images.firmware()?, 2).attach(here, there).seed(1);
    let mut engine = Engine::new(robot.build()?, 2);
    for controller in Controller::ALL {
        let traced = mcu(&mut engine, controller)?.trace();
        traced.map_err(|error| unmeasurable("firmware", error.to_string()))?;
    }
    engine.run_until(2 * SECOND);
    let change = Change::Loss { links: Links::From(there), probability: 1.0 };
    engine.change(&change).map_err(|error| unmeasurable("robot", error.to_string()))?;
    Ok(engine)
}

fn mcu(engine: &mut Engine, controller: Controller) -> Result<&mut Mcu, BenchError> {
    let module = engine.robot_mut().module_mut(MEASURED);
    Ok(module.ok_or_else(|| unmeasurable("robot", "it has no module"))?.mcu_mut(controller))
}

/// The label of a new message. Its turn differs from that of the message before.
fn label(number: u64) -> Label {
    let turn = if number.is_multiple_of(2) { Turn::Even } else { Turn::Odd };
    Label { signature: Signature { dock: Dock::Front, epoch: 0x55 }, turn }
}

fn bytes(frame: Frame) -> Vec<u8> {
    let mut wire = WireBuffer::new();
    // No payload here is longer than the longest, so encoding does not fail.
    let _ = frame.encode(&mut wire);
    wire.bytes().to_vec()
}

/// The bytes of a new message whose bits alternate.
fn alternating(number: u64) -> Vec<u8> {
    bytes(Frame::Data { label: label(number), to: TaskCode::HORMONE, payload: &[0x55; MAX_PAYLOAD] })
}

/// The bytes of an ACK, or of a new message to any behaviour.
fn frame(number: u64, random: &mut Random) -> Vec<u8> {
    let label = label(number);
    let payload: Vec<u8> = (0..random.below(MAX_PAYLOAD + 1)).map(|_| random.below(256) as u8).collect();
    match TaskCode::of_behaviour(random.below(usize::from(TaskCode::BEHAVIOURS) + 1) as u8) {
        Some(to) => bytes(Frame::Data { label, to, payload: &payload }),
        None => bytes(Frame::Ack(label)),
    }
}

/// Delivers the bytes of a turn to all docks of the module, each from a random moment on.
fn come_in(engine: &mut Engine, load: Load, random: &mut Random, came: &mut Came) -> Result<(), BenchError> {
    let now = engine.cycle();
    for (port, controller) in (0..PORTS).flat_map(|port| Controller::ALL.map(|mcu| (port, mcu))) {
        let mcu = mcu(engine, controller)?;
        let first = now + random.below(BYTE as usize) as u64;
        let starts = (first..=now + TURN - BYTE).step_by(BYTE as usize);
        let values = (0..).flat_map(|number| match load {
            Load::Alternating => alternating(number),
            Load::Frames => frame(number, random),
            Load::Babble => vec![random.below(256) as u8 * u8::from(!random.chance(0.25))],
            Load::Zeros => vec![0],
        });
        for (start, value) in starts.zip(values) {
            let character = Character { value, start, end: start + BYTE };
            mcu.receive(port, character);
            came.push((controller, port, character));
        }
    }
    Ok(())
}

/// The cycle at which the first of periodic events was due: they are due 1 ms apart, as early as the earliest
/// of them came. 0 without any.
fn first_due(begins: &[u64]) -> u64 {
    let earliest = offsets(begins).min().unwrap_or(0);
    begins.first().map_or(0, |first| first.saturating_add_signed(earliest))
}

/// The cycles from when an event was due up to `cycle`, at which it came.
fn late(first_due: u64, cycle: u64) -> u64 {
    (cycle - first_due) % MILLISECOND
}

/// The longest time from when a period was due until its drives were computed. Periods are due 1 ms apart, as
/// early as the earliest began.
fn longest(edges: &[Edge]) -> Result<u64, BenchError> {
    let begins: Vec<_> = edges.iter().filter(|edge| edge.level).map(|edge| edge.cycle).collect();
    let due = first_due(&begins);
    let periods = begins.len();
    if periods < PERIODS {
        return Err(unmeasurable("firmware", format!("it controlled its joints in {periods} periods only")));
    }
    let pairs = edges.windows(2).filter(|pair| pair[0].level && !pair[1].level);
    let spans = pairs.map(|pair| pair[1].cycle - pair[0].cycle + late(due, pair[0].cycle));
    Ok(spans.max().unwrap_or(0))
}

/// The longest time that interrupts have waited since `start`, by vector.
fn waited(trace: &Trace, came: &Came, controller: Controller, start: u64) -> BTreeMap<u8, u64> {
    let accepted = |vector| {
        let of_vector = trace.interrupts.iter().filter(move |slice| slice.what == vector);
        of_vector.map(|slice| slice.begin).filter(move |&begin| begin >= start)
    };
    let of_period = [ROUND, TICK].map(|vector| {
        // It is due once in a period, as early as it was ever accepted.
        let begins: Vec<_> = accepted(vector).collect();
        let due = first_due(&begins);
        let waits = begins.into_iter().map(|begin| late(due, begin));
        (vector, waits.max().unwrap_or(0))
    });
    let of_port = (0..).zip(RECEIVED).map(|(port, vector)| {
        let begins: Vec<_> = accepted(vector).collect();
        let here = came.iter().filter(|one| (one.0, one.1) == (controller, port));
        let waits = here.filter_map(|(_, _, Character { end, .. })| {
            begins.get(begins.partition_point(|begin| begin < end)).map(|begin| begin - end)
        });
        (vector, waits.max().unwrap_or(0))
    });
    of_period.into_iter().chain(of_port).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_earliest_phase_may_lie_before_the_end_of_a_millisecond() {
        let phase = |cycles: &[u64]| first_due(cycles) % MILLISECOND;
        assert_eq!(phase(&[16_010, 31_990, 48_030]), 15_990);
        assert_eq!(phase(&[15_990, 32_010]), 15_990);
        assert_eq!(phase(&[100, 16_090, 32_400]), 90);
        assert_eq!([15_990, 16_010].map(|cycle| late(15_990, cycle)), [0, 20]);
    }
}
