//! The receiving tasks of the docks (paper, section 5): they take frames off their lines and have a
//! [`Receiver`] deal with them.
//!
//! Each runs to completion for what has come at its dock, so they share a stack.

use core::marker::PhantomData;

use kernel::{Never, Semaphore, Task, now};

use super::counters::Counted;
use super::endpoint::Endpoint;
use super::frame::{Frame, Label};
use super::port::{AtPort, Port};
use super::receiver::{Arriving, Receiver};
use super::sender::Shared;
use super::sizes::MAX_WIRE;
use crate::device::{Latches, Receive};
use crate::message::Message;
use crate::post_office::{PostOffice, Undelivered};
use crate::router::Source;

/// The receiving task of a dock.
pub struct Incoming<Line> {
    port: &'static Port,
    line: Line,
    /// The frame that is coming in.
    wire: [u8; MAX_WIRE],
    receiver: Receiver,
}

impl<Line: Receive> Incoming<Line> {
    /// The task of `port` on `line`.
    pub const fn new(port: &'static Port, line: Line) -> Self {
        Incoming { port, line, wire: [0; MAX_WIRE], receiver: Receiver::new(port.dock(), 0) }
    }

    /// Has `signal` posted when something comes in.
    pub fn begin(&mut self, task: &mut Task, signal: &'static Semaphore, seed: u16) {
        self.receiver = Receiver::new(self.port.dock(), now(task));
        self.port.restart(task, seed);
        self.line.listen(task, signal);
    }

    /// Takes what has come in.
    #[inline(always)] // a frame of its own would take 30 bytes more of the stack
    pub fn receive<L: Latches>(&mut self, task: &mut Task, office: &'static PostOffice) {
        while let Some(length) = self.line.receive(task, &mut self.wire) {
            let (port, overruns) = (self.port, self.line.overruns(task));
            port.counters.overruns.set(task, overruns);
            let frame = self.wire.get_mut(..length).and_then(|wire| Frame::decode(wire).ok());
            let Some(frame) = frame else {
                port.counters.errors.count(task);
                continue;
            };
            let time = now(task);
            let port = AtPort { task, port };
            let latches = PhantomData::<L>;
            self.receiver.receive(time, frame, &mut Delivering { port, office, latches });
        }
    }
}

/// Runs the receiving tasks of `docks`, whose latches are `L`'s. They wait on `signal`. The seed of each
/// should differ from dock to dock and from boot to boot; see
/// [`Endpoint::new`](super::endpoint::Endpoint::new).
pub fn run<Line: Receive, L: Latches, const N: usize>(
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
            dock.receive::<L>(task, office);
        }
        signal.wait(task);
    }
}

/// A port, and where its messages go.
struct Delivering<'a, L> {
    port: AtPort<'a>,
    office: &'static PostOffice,
    latches: PhantomData<L>,
}

impl<L> Shared for Delivering<'_, L> {
    fn endpoint<R>(&mut self, work: impl FnOnce(&mut Endpoint) -> R) -> R {
        self.port.endpoint(work)
    }

    fn count(&mut self, what: Counted) {
        self.port.count(what);
    }
}

impl<L: Latches> Arriving for Delivering<'_, L> {
    #[inline(always)] // a frame of its own would take 40 bytes more of the stack
    fn deliver(&mut self, message: Message) -> Result<(), Undelivered> {
        let AtPort { task, port } = &mut self.port;
        self.office.deliver(task, message, Source::Dock(port.dock()))
    }

    fn acknowledge(&mut self, label: Label) {
        self.port.port.acknowledge(self.port.task, label);
    }

    fn wake_sender(&mut self) {
        self.port.port.mailbox().wake(self.port.task);
    }

    fn is_open(&self) -> bool {
        L::is_open(self.port.port.dock())
    }
}
