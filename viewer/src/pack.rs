//! A recording as bytes. Whole numbers are varints (LEB128, the lowest seven bits first), signed numbers in
//! zigzag (0, -1, 1, -2, ...). In a row each number but the first is the difference from the one before.
//! `page/unpack.js` reads them.
//!
//! 1. A row over the samples for each of ten numbers of each module: x, y, z in units of [`POSITION`], the
//!    quaternion's x, y, z, w in units of [`TURN`], the angles of the joints in units of [`ANGLE`].
//! 2. The number of hormones, and for each: microseconds since the one before, dock, letter, microseconds on
//!    the way plus 1, or 0 if it did not arrive.
//! 3. The number of trace events, and for each: microseconds since the one before, module, code.
//! 4. The number of views, and for each: samples since the one before, module, docks as bits, type plus 1, or
//!    0 for none.
//! 5. The number of losses, and for each: samples since the one before, dock, frames.
//!
//! A dock is encoded as six times its module's number plus its own.

use glam::DQuat;
use simulation::{CLOCK_HZ, Face, Placing, Recording};
use tasks::dock::Dock;

/// The unit of positions, in mm.
pub const POSITION: f64 = 0.5;
/// The unit of a quaternion's components, as a fraction of 1.
pub const TURN: f64 = 1.0 / 2048.0;
/// The unit of angles, in degrees.
pub const ANGLE: f64 = 0.2;

/// The numbers of a module in a sample.
const NUMBERS: usize = 10;

/// Cycles of a microsecond.
const MICROSECOND: u64 = CLOCK_HZ as u64 / 1_000_000;

pub fn pack(recording: &Recording) -> Vec<u8> {
    let mut bytes = Bytes(Vec::new());
    for module in 0..recording.modules {
        let placings = recording.placings.iter().skip(module).step_by(recording.modules);
        bytes.placings(placings);
    }
    bytes.hormones(recording);
    bytes.number(recording.trace_events.len() as u64);
    let mut before = 0;
    for trace_event in &recording.trace_events {
        bytes.later(&mut before, trace_event.cycle / MICROSECOND);
        bytes.number(trace_event.module as u64);
        bytes.number(u64::from(trace_event.event.to_byte()));
    }
    bytes.number(recording.views.len() as u64);
    let mut before = 0;
    for view in &recording.views {
        bytes.later(&mut before, view.look as u64);
        bytes.number(view.module as u64);
        let found = Dock::ALL.iter().filter(|dock| view.docks.contains(**dock));
        bytes.number(found.map(|dock| 1 << dock.index()).sum());
        bytes.number(view.module_type.map_or(0, |module_type| module_type as u64 + 1));
    }
    let losses = recording.losses.as_deref().unwrap_or_default();
    bytes.number(losses.len() as u64);
    let mut before = 0;
    for loss in losses {
        bytes.later(&mut before, loss.look as u64);
        bytes.face(loss.from);
        bytes.number(loss.frames);
    }
    bytes.0
}

struct Bytes(Vec<u8>);

impl Bytes {
    fn placings<'a>(&mut self, placings: impl Iterator<Item = &'a Placing>) {
        let mut rows: [Vec<i64>; NUMBERS] = Default::default();
        let mut before = DQuat::IDENTITY;
        for Placing { frame, angles } in placings {
            let turn = DQuat::from_mat3(&frame.matrix3);
            // Two quaternions stand for the same rotation; take the one nearer to the last.
            before = if turn.dot(before) < 0.0 { -turn } else { turn };
            let numbers = frame.translation.to_array().map(|millimetres| millimetres / POSITION).into_iter();
            let numbers = numbers.chain(before.to_array().map(|part| part / TURN));
            let numbers = numbers.chain(angles.map(|degrees| degrees / ANGLE));
            rows.iter_mut().zip(numbers).for_each(|(row, number)| row.push(number.round() as i64));
        }
        for row in rows {
            let mut before = 0;
            for number in row {
                self.signed(number - before);
                before = number;
            }
        }
    }

    fn hormones(&mut self, recording: &Recording) {
        self.number(recording.hormones.len() as u64);
        let mut before = 0;
        for passage in &recording.hormones {
            let sent = passage.sent / MICROSECOND;
            self.later(&mut before, sent);
            self.face(passage.from);
            self.number(passage.data as u64);
            self.number(
                passage.arrived.map_or(0, |arrived| (arrived / MICROSECOND).saturating_sub(sent) + 1),
            );
        }
    }

    /// Writes how much later this is than the one before.
    fn later(&mut self, before: &mut u64, now: u64) {
        self.number(now.saturating_sub(*before));
        *before = now.max(*before);
    }

    fn face(&mut self, Face { module, dock }: Face) {
        self.number((module * Dock::ALL.len()) as u64 + u64::from(dock.index()));
    }

    fn signed(&mut self, number: i64) {
        self.number((number << 1 ^ number >> 63) as u64);
    }

    fn number(&mut self, mut number: u64) {
        while number >= 0x80 {
            self.0.push(number as u8 | 0x80);
            number >>= 7;
        }
        self.0.push(number as u8);
    }
}
