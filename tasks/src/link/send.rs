//! The sending task of a dock (paper, section 5): sends what is in its queue, one message at a time, and
//! repeats it until the neighbour acknowledges it or the ARQ gives up.

use kernel::{Never, Task, Ticks, now};

use super::arq::Timeout;
use super::backoff::Backoff;
use super::cobs::WireBuffer;
use super::frame::{Frame, Label};
use super::port::Port;
use crate::device::Transmit;
use crate::message::{Address, Buffered, Message};

/// How long an ACK may take from the end of the message's frame, in ticks of 1 ms: at 38400 baud an ACK is 1.6 ms
/// on the wire, and behind the longest frame that the neighbour may have just begun, 6.3 ms.
const ACK_TIMEOUT: Ticks = 9;

/// Runs the sending task of `port`. `seed` should differ from dock to dock and from module to module.
pub fn run(task: &mut Task, port: &'static Port, line: impl Transmit, seed: u16) -> Never {
    let mut sender = Sender { port, line, wire: WireBuffer::new(), backoff: Backoff::new(seed) };
    let mut outstanding = None;
    loop {
        port.mailbox().wait(task);
        if let Some(label) = port.take_ack_due(task) {
            sender.transmit(task, Frame::Ack(label));
        }
        outstanding = outstanding.and_then(|message| sender.look_after(task, message));
        while outstanding.is_none()
            && let Some(message) = port.mailbox().take(task)
        {
            outstanding = sender.begin(task, message);
        }
    }
}

/// A message on its way, until it is acknowledged or given up.
struct Outstanding {
    message: Buffered,
    label: Label,
    /// When the ACK is overdue.
    deadline: Ticks,
}

struct Sender<Line> {
    port: &'static Port,
    line: Line,
    wire: WireBuffer,
    backoff: Backoff,
}

impl<Line: Transmit> Sender<Line> {
    /// Sends a message for the first time. What comes back is still to be acknowledged.
    fn begin(&mut self, task: &mut Task, message: Buffered) -> Option<Outstanding> {
        if message.is_datagram() {
            let signature = self.port.with(task, |state| state.endpoint.sign_datagram());
            let (to, payload) = (beyond(&message), message.payload());
            self.transmit(task, Frame::Datagram { signature, to, payload });
            return None;
        }
        let label = self.port.with(task, |state| state.endpoint.sender.start());
        Some(self.send(task, message, label))
    }

    /// Sees whether an outstanding message has arrived or its time is up. What comes back still is outstanding.
    fn look_after(&mut self, task: &mut Task, outstanding: Outstanding) -> Option<Outstanding> {
        if !self.port.with(task, |state| state.endpoint.sender.is_busy()) {
            return None;
        }
        let left = outstanding.deadline.wrapping_sub(now(task));
        if left != 0 && left <= kernel::LONGEST {
            return Some(outstanding);
        }
        let Outstanding { message, label, .. } = outstanding;
        match self.port.with(task, |state| state.endpoint.sender.on_timeout())? {
            Timeout::Retransmit => {
                self.port.count(task, |counters| &mut counters.retries);
                Some(self.send(task, message, label))
            }
            Timeout::GaveUp => {
                self.port.count(task, |counters| &mut counters.gave_up);
                None
            }
        }
    }

    /// Sends a message under ARQ, and sets the alarm for its ACK.
    fn send(&mut self, task: &mut Task, message: Buffered, label: Label) -> Outstanding {
        let (to, payload) = (beyond(&message), message.payload());
        self.transmit(task, Frame::Data { label, to, payload });
        let patience = ACK_TIMEOUT + Ticks::from(self.backoff.next_ms());
        // In this order: a tick between the two makes the alarm late, not early. Nobody would set another one.
        let deadline = now(task).wrapping_add(patience);
        self.port.mailbox().wake_in(task, patience);
        Outstanding { message, label, deadline }
    }

    fn transmit(&mut self, task: &mut Task, frame: Frame) {
        // A message holds no more than a frame, so this never fails; if it did, nothing would go out.
        if frame.encode(&mut self.wire).is_ok() {
            self.line.transmit(task, self.wire.bytes());
            self.port.count(task, |counters| &mut counters.frames_sent);
        }
    }
}

/// The address as the neighbour understands it: a task of its own.
fn beyond(message: &Message) -> Address {
    Address::here(message.to().task())
}
