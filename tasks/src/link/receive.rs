//! The receiving tasks of the docks (paper, section 5): they take frames off their lines and deliver what
//! these bring.
//!
//! Each runs to completion for what has come at its dock, so they share a stack.

use kernel::{Never, Semaphore, Task, Ticks, now};

use super::cobs::MAX_WIRE;
use super::endpoint::Arrival;
use super::frame::Frame;
use super::port::Port;
use crate::device::Receive;
use crate::message::{Address, Message, TaskCode};
use crate::post_office::{PostOffice, Undelivered};
use crate::router::Source;

/// Who speaks after a silence of this many ticks of 1 ms may be another module than before, whose first
/// message is no repetition whatever its label. A neighbour that is there probes every 40 ms. (A silence of a
/// few ms more than a multiple of 65.5 s is not noticed; then what [`arq`](super::arq) says of equal epochs
/// remains.)
pub const SILENCE: Ticks = 400;

/// The receiving task of a dock.
pub struct Incoming<Line> {
    port: &'static Port,
    line: Line,
    /// The frame that is coming in.
    wire: [u8; MAX_WIRE],
    /// When the last frame came.
    heard_at: Ticks,
}

impl<Line: Receive> Incoming<Line> {
    /// The task of `port` on `line`.
    pub const fn new(port: &'static Port, line: Line) -> Self {
        Incoming { port, line, wire: [0; MAX_WIRE], heard_at: 0 }
    }

    /// Has `signal` posted when something comes in.
    fn begin(&mut self, task: &mut Task, signal: &'static Semaphore, seed: u16) {
        self.heard_at = now(task);
        self.port.restart(task, seed);
        self.line.listen(task, signal);
    }

    /// Takes what has come in.
    #[inline(always)] // a frame of its own would take 30 bytes more of the stack
    fn receive(&mut self, task: &mut Task, office: &'static PostOffice) {
        while let Some(length) = self.line.receive(task, &mut self.wire) {
            let (port, overruns) = (self.port, self.line.overruns(task));
            port.counters.overruns.set(task, overruns);
            let frame = self.wire.get_mut(..length).and_then(|wire| Frame::decode(wire).ok());
            let Some(frame) = frame else {
                port.counters.errors.count(task);
                continue;
            };
            port.counters.frames_received.count(task);
            let time = now(task);
            let is_stranger = time.wrapping_sub(self.heard_at) > SILENCE;
            self.heard_at = time;
            let arrival = port.with(task, |endpoint| {
                if is_stranger {
                    endpoint.forget_neighbour();
                }
                endpoint.on_frame(frame)
            });
            take(task, port, office, arrival);
        }
    }
}

/// Runs the receiving tasks of `docks`, which wait on `signal`. The seed of each should differ from dock to
/// dock and from boot to boot; see [`Endpoint::new`](super::endpoint::Endpoint::new).
pub fn run<Line: Receive, const N: usize>(
    task: &mut Task,
    mut docks: [Incoming<Line>; N],
    signal: &'static Semaphore,
    office: &'static PostOffice,
    seeds: [u16; N],
) -> Never {
    for (dock, seed) in docks.iter_mut().zip(seeds) {
        dock.begin(task, signal, seed);
    }
    loop {
        for dock in &mut docks {
            dock.receive(task, office);
        }
        signal.wait(task);
    }
}

/// Does what an arrival asks for.
fn take(task: &mut Task, port: &'static Port, office: &'static PostOffice, arrival: Arrival) {
    match arrival {
        Arrival::Message { label, to, payload } => {
            // Acknowledged unless there is no room now: what nobody here wants, no repetition helps.
            if deliver(task, port, office, to, payload) {
                port.with(task, |endpoint| endpoint.accept(label));
                port.acknowledge(task, label);
            }
        }
        Arrival::Duplicate(label) => {
            port.counters.duplicates.count(task);
            port.acknowledge(task, label);
        }
        Arrival::Datagram { to, payload } => {
            deliver(task, port, office, to, payload);
        }
        Arrival::Delivered => port.mailbox().wake(task),
        Arrival::StaleAck => {}
        Arrival::Reflection => port.counters.reflections.count(task),
    }
}

/// Hands a message on, and counts it if that fails. Returns whether it is dealt with.
#[inline(always)] // a frame of its own would take 40 bytes more of the stack
fn deliver(
    task: &mut Task,
    port: &'static Port,
    office: &'static PostOffice,
    to: TaskCode,
    payload: &[u8],
) -> bool {
    let from = Address::beyond(port.dock(), to);
    // A frame holds no more than a message.
    let Ok(message) = Message::new(Address::here(to), from, payload) else { return true };
    let Err(undelivered) = office.deliver(task, message, Source::Dock(port.dock())) else { return true };
    let counter = match undelivered {
        Undelivered::Ignored => &port.counters.ignored,
        Undelivered::Refused => &port.counters.refused,
        Undelivered::NoRoom => &port.counters.no_buffer,
    };
    counter.count(task);
    undelivered != Undelivered::NoRoom
}
