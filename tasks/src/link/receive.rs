//! The receiving task of a dock (paper, section 5): takes frames off the line and delivers what they bring.

use kernel::{Never, Task, Ticks, now};

use super::cobs::MAX_WIRE;
use super::endpoint::Arrival;
use super::frame::Frame;
use super::port::Port;
use crate::device::Receive;
use crate::message::{Address, Message, TaskCode};
use crate::post_office::{PostOffice, Undelivered};
use crate::router::Source;

/// Who speaks after a silence of this many ticks of 1 ms may be another module than before, whose first message is no
/// repetition whatever its label. A neighbour that is there probes every 40 ms. (A silence of a few ms more than a multiple
/// of 65.5 s is not noticed; then what [`arq`](super::arq) says of equal epochs remains.)
pub const SILENCE: Ticks = 400;

/// Runs the receiving task of `port`. `seed` should differ from boot to boot; see [`Endpoint::new`](super::endpoint::Endpoint::new).
pub fn run(
    task: &mut Task,
    port: &'static Port,
    mut line: impl Receive,
    office: &'static PostOffice,
    seed: u16,
) -> Never {
    port.restart(task, seed);
    let mut wire = [0; MAX_WIRE];
    let mut heard_at = now(task);
    loop {
        let length = line.receive(task, &mut wire);
        let overruns = line.overruns(task);
        let frame = wire.get_mut(..length).and_then(|wire| Frame::decode(wire).ok());
        let time = now(task);
        let is_stranger = frame.is_some() && time.wrapping_sub(heard_at) > SILENCE;
        let arrival = port.with(task, |state| {
            state.counters.overruns = overruns;
            let Some(frame) = frame else {
                state.counters.errors = state.counters.errors.wrapping_add(1);
                return None;
            };
            state.counters.frames_received = state.counters.frames_received.wrapping_add(1);
            if is_stranger {
                state.endpoint.forget_neighbour();
            }
            Some(state.endpoint.on_frame(frame))
        });
        if let Some(arrival) = arrival {
            heard_at = time;
            take(task, port, office, arrival);
        }
    }
}

/// Does what an arrival asks for.
fn take(task: &mut Task, port: &'static Port, office: &'static PostOffice, arrival: Arrival) {
    match arrival {
        Arrival::Message { label, to, payload } => {
            // Acknowledged unless there is no room now: what nobody here wants, no repetition helps.
            if deliver(task, port, office, to, payload) {
                port.with(task, |state| state.endpoint.accept(label));
                port.acknowledge(task, label);
            }
        }
        Arrival::Duplicate(label) => {
            port.count(task, |counters| &mut counters.duplicates);
            port.acknowledge(task, label);
        }
        Arrival::Datagram { to, payload } => {
            deliver(task, port, office, to, payload);
        }
        Arrival::Delivered => port.mailbox().wake(task),
        Arrival::StaleAck => {}
        Arrival::Reflection => port.count(task, |counters| &mut counters.reflections),
    }
}

/// Hands a message on, and counts it if that fails. Returns whether it is dealt with.
#[inline(always)] // a frame of its own would cost the three stacks 40 bytes each
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
    port.count(task, |counters| match undelivered {
        Undelivered::Ignored => &mut counters.ignored,
        Undelivered::Refused => &mut counters.refused,
        Undelivered::NoRoom => &mut counters.no_buffer,
    });
    undelivered != Undelivered::NoRoom
}
