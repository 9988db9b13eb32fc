//! The sending task of a dock (paper, section 5): sends what is in its queue, one message at a time, and
//! repeats it until the neighbour acknowledges it or the ARQ gives up.

use kernel::{Never, Task, Ticks, now};

use super::arq::Timeout;
use super::backoff::Backoff;
use super::cobs::WireBuffer;
use super::endpoint::Endpoint;
use super::frame::{Frame, Label};
use super::port::Port;
use crate::device::Transmit;
use crate::message::{Buffered, Kind, Letter};

/// How long an ACK may take to begin after the end of the message's frame, in ticks of 1 ms. A neighbour that
/// heard the message was not sending, so the ACK is the next that it sends; once something comes in, its end
/// is waited for.
pub const ACK_TIMEOUT: Ticks = 3;

/// Runs the sending task of `port`. `seed` should differ from dock to dock and from module to module.
pub fn run(task: &mut Task, port: &'static Port, line: impl Transmit, seed: u16) -> Never {
    let mut sender = Sender {
        port,
        line,
        wire: WireBuffer::new(),
        in_wire: None,
        backoff: Backoff::new(seed),
        is_repeated: false,
        waiting: None,
        held: None,
    };
    let mut outstanding = None;
    // When the alarm rings that is set.
    let mut alarm = None;
    loop {
        port.mailbox().wait(task);
        if sender.line.is_busy(task) {
            port.mailbox().wake_in(task, 1);
            alarm = None;
            continue;
        }
        if let Some(label) = port.take_ack_due(task) {
            sender.transmit(task, Frame::Ack(label));
        }
        outstanding = outstanding.and_then(|message| sender.look_after(task, message));
        while outstanding.is_none()
            && let Some(message) = sender.next(task)
        {
            outstanding = sender.begin(task, message);
        }
        let due = match &outstanding {
            Some(Outstanding { deadline, .. }) => Some(*deadline),
            None => sender.look_after_datagram(task),
        };
        if due != alarm {
            match due {
                Some(time) => {
                    let left = left(task, time).unwrap_or(0);
                    port.mailbox().wake_in(task, left);
                }
                None => port.mailbox().cancel_alarm(task),
            }
            alarm = due;
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

/// A datagram that waits for its moment. Two ends of a half-duplex line that begin at once do not hear each
/// other, and what is not acknowledged is not repeated: probes of modules in step would be lost again and
/// again.
struct Waiting {
    datagram: Buffered,
    moment: Ticks,
}

struct Sender<Line> {
    port: &'static Port,
    line: Line,
    wire: WireBuffer,
    /// The message whose frame is in `wire`.
    in_wire: Option<Label>,
    backoff: Backoff,
    /// Whether the message under way was sent before.
    is_repeated: bool,
    waiting: Option<Waiting>,
    /// The message that follows the one under way.
    held: Option<Buffered>,
}

impl<Line: Transmit> Sender<Line> {
    /// The next message to be sent: of several in a row of which the newest alone matters, that.
    fn next(&mut self, task: &mut Task) -> Option<Buffered> {
        let mut next = self.held.take().or_else(|| self.port.mailbox().take(task))?;
        while next.kind() == Kind::Latest {
            self.held = self.port.mailbox().take(task);
            let Some(newer) = self.held.take_if(|after| after.replaces(&next)) else { break };
            next = newer;
            self.port.counters.replaced.count(task);
        }
        Some(next)
    }

    /// Sends a message for the first time, or lets it wait if it is a datagram. What comes back is still to
    /// be acknowledged.
    fn begin(&mut self, task: &mut Task, message: Buffered) -> Option<Outstanding> {
        if message.kind() == Kind::Datagram {
            let moment = now(task).wrapping_add(Ticks::from(self.backoff.next_ms()));
            if let Some(before) = self.waiting.replace(Waiting { datagram: message, moment }) {
                self.send_datagram(task, &before.datagram);
            }
            return None;
        }
        let label = self.port.with(task, |endpoint| endpoint.sender.start());
        self.is_repeated = false;
        Some(self.send(task, message, label, ACK_TIMEOUT))
    }

    /// Sends the datagram that waits, if its moment has come. If not, returns when that is.
    fn look_after_datagram(&mut self, task: &mut Task) -> Option<Ticks> {
        let moment = self.waiting.as_ref()?.moment;
        if left(task, moment).is_some() {
            return Some(moment);
        }
        let waiting = self.waiting.take()?;
        self.send_datagram(task, &waiting.datagram);
        None
    }

    fn send_datagram(&mut self, task: &mut Task, datagram: &Letter) {
        let signature = self.port.with(task, Endpoint::sign_datagram);
        let (to, payload) = (datagram.to().task(), datagram.payload());
        self.transmit(task, Frame::Datagram { signature, to, payload });
    }

    /// Sees whether an outstanding message has arrived or its time is up. What comes back still is
    /// outstanding.
    fn look_after(&mut self, task: &mut Task, outstanding: Outstanding) -> Option<Outstanding> {
        if !self.port.with(task, |endpoint| endpoint.sender.is_busy()) {
            return None;
        }
        if left(task, outstanding.deadline).is_some() {
            return Some(outstanding);
        }
        let Outstanding { message, label, .. } = outstanding;
        match self.port.with(task, |endpoint| endpoint.sender.on_timeout())? {
            Timeout::Retransmit => {
                self.port.counters.retries.count(task);
                // Two ends that have collided again and again repeat after the same time.
                let part = if self.is_repeated { Ticks::from(self.backoff.next_ms()) } else { 0 };
                self.is_repeated = true;
                Some(self.send(task, message, label, ACK_TIMEOUT + part))
            }
            Timeout::GaveUp => {
                self.port.counters.gave_up.count(task);
                None
            }
        }
    }

    /// Sends a message under ARQ.
    fn send(&mut self, task: &mut Task, message: Buffered, label: Label, patience: Ticks) -> Outstanding {
        let (to, payload) = (message.to().task(), message.payload());
        self.transmit(task, Frame::Data { label, to, payload });
        let deadline = now(task).wrapping_add(patience);
        Outstanding { message, label, deadline }
    }

    fn transmit(&mut self, task: &mut Task, frame: Frame) {
        let message = match frame {
            Frame::Data { label, .. } => Some(label),
            _ => None,
        };
        let is_there = message.is_some() && message == self.in_wire;
        self.in_wire = message;
        // The router lets nothing come here that no frame can say. If it did, nothing would go out.
        if is_there || frame.encode(&mut self.wire).is_ok() {
            self.line.transmit(task, self.wire.bytes());
            self.port.counters.frames_sent.count(task);
        }
    }
}

/// How many ticks are left until `time`; `None` if none is.
fn left(task: &mut Task, time: Ticks) -> Option<Ticks> {
    let left = time.wrapping_sub(now(task));
    (left != 0 && left <= kernel::LONGEST).then_some(left)
}
