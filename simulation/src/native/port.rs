//! A dock's link: the sender and the receiver of the dock's tasks, and what frames take on the wire.

use std::cell::Cell;
use std::collections::VecDeque;
use std::hash::{Hash, Hasher};
use std::ops::Range;

use tasks::dock::Dock;
use tasks::link::counters::{Counted, LinkCounters};
use tasks::link::endpoint::Endpoint;
use tasks::link::frame::{Frame, Label};
use tasks::link::port::{RETRY_LIMIT, ROOM};
use tasks::link::receiver::{Arriving, Receiver};
use tasks::link::sender::{Departing, Sender, Shared};
use tasks::link::signature::Signature;
use tasks::message::{Address, Kind, Letter, Message, TaskCode};
use tasks::post_office::Undelivered;

use crate::hardware::CHARACTER;

use super::time::{Clock, RECEIVE, RECEIVE_ACK, SEND, SENT, TICK, ack, frame};

/// What goes over the wire in one piece.
#[derive(Clone, Debug)]
pub enum Wire {
    Data(Label, Letter),
    Ack(Label),
    Datagram(Signature, Letter),
}

/// A frame on its way.
#[derive(Clone, Debug)]
pub struct Flight {
    pub wire: Wire,
    /// From its first bit to its last.
    pub span: Range<u64>,
    /// Where light is shared, when it was sent: what the other end sent meanwhile has drowned it.
    pub shared: Option<Range<u64>>,
}

impl Flight {
    /// The same, so many cycles later.
    pub fn later(mut self, cycles: u64) -> Flight {
        self.span = self.span.start + cycles..self.span.end + cycles;
        self
    }

    /// When the receiving task is through with it.
    pub fn taken_at(&self) -> u64 {
        let program = if matches!(self.wire, Wire::Ack(_)) { RECEIVE_ACK } else { RECEIVE };
        self.span.end + program
    }
}

impl Wire {
    fn of(frame: Frame) -> Wire {
        let letter = |to: TaskCode, payload| {
            let to = Address::here(to);
            // A frame holds no more than a message.
            Letter::of(Message::new(to, to, payload).expect("it came out of a letter"))
        };
        match frame {
            Frame::Ack(label) => Wire::Ack(label),
            Frame::Data { label, to, payload } => Wire::Data(label, letter(to, payload)),
            Frame::Datagram { signature, to, payload } => Wire::Datagram(signature, letter(to, payload)),
        }
    }

    fn cycles(&self) -> u64 {
        match self {
            Wire::Ack(_) => ack(),
            Wire::Data(_, message) | Wire::Datagram(_, message) => frame(message.payload().len()),
        }
    }

    fn frame(&self) -> Frame<'_> {
        let to = |message: &Letter| message.to().task();
        match self {
            Wire::Ack(label) => Frame::Ack(*label),
            Wire::Data(label, message) => {
                Frame::Data { label: *label, to: to(message), payload: message.payload() }
            }
            Wire::Datagram(signature, message) => {
                Frame::Datagram { signature: *signature, to: to(message), payload: message.payload() }
            }
        }
    }

    /// Bytes on the wire.
    pub fn bytes(&self) -> u64 {
        self.cycles() / CHARACTER
    }
}

pub struct Port {
    sender: Sender<Letter>,
    receiver: Receiver,
    end: End,
    /// When the sender is polled even if nothing comes.
    alarm: Option<u64>,
    /// Until when the sending task sends what it sent last.
    sends_until: u64,
    /// The last frame that was sent, and the one before.
    sent: [Range<u64>; 2],
    /// The last frame of which a character came in.
    incoming: Range<u64>,
}

/// The state that sender and receiver share.
struct End {
    endpoint: Endpoint,
    mailbox: VecDeque<Letter>,
    ack_due: Option<Label>,
    /// Whether the sender is to be polled at once.
    is_awake: bool,
    counters: LinkCounters<Cell<u16>>,
}

impl Hash for Port {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.end.endpoint.hash(state);
        self.end.ack_due.hash(state);
        self.end.mailbox.iter().for_each(|message| message.payload().hash(state));
        (self.alarm, self.end.is_awake).hash(state);
        (self.sends_until, self.end.counters.frames_sent.get()).hash(state);
    }
}

impl Port {
    /// The link at `dock`, from the time on at which `clock` starts.
    pub fn new(dock: Dock, seed: u16, clock: Clock) -> Self {
        let end = End {
            endpoint: Endpoint::new(dock, seed, RETRY_LIMIT),
            mailbox: VecDeque::new(),
            ack_due: None,
            is_awake: false,
            counters: LinkCounters::default(),
        };
        Port {
            sender: Sender::new(seed),
            receiver: Receiver::new(dock, 0),
            end,
            alarm: None,
            sends_until: clock.started_at,
            sent: [0..0, 0..0],
            incoming: 0..0,
        }
    }

    /// The link's counts.
    pub fn counters(&self) -> LinkCounters {
        self.end.counters.map(Cell::get)
    }

    /// Whether the sending task's mailbox has room for one of this kind more than `coming` messages.
    pub fn has_room(&self, kind: Kind, coming: usize) -> bool {
        self.end.mailbox.len() + coming < usize::from(ROOM - kind.leaves())
    }

    /// Puts a message into the sending task's mailbox. Returns whether there was room.
    pub fn put(&mut self, message: Letter) -> bool {
        let has_room = self.has_room(message.kind(), 0);
        if has_room {
            self.end.mailbox.push_back(message);
            self.end.is_awake = true;
        }
        has_room
    }

    /// The first character of a frame has come in.
    pub fn expect(&mut self, span: Range<u64>) {
        self.incoming = span;
    }

    /// Counts bytes that came in and are no frame.
    pub fn garbled(&mut self) {
        self.end.count(Counted::Errors);
    }

    /// Whether a frame that this end sent itself drowned a part of another one.
    pub fn has_drowned(&self, span: &Range<u64>) -> bool {
        self.sent.iter().any(|sent| sent.start < span.end && span.start < sent.end)
    }

    /// When the sending task has something to do; never before `now`.
    pub fn due(&self, now: u64) -> Option<u64> {
        let due = if self.end.is_awake { now } else { self.alarm? };
        Some(due.max(self.sends_until).max(now))
    }

    /// Does what the sending task does at `now`. Returns the frame that it begins to send.
    pub fn send(&mut self, now: u64, clock: Clock) -> Option<Flight> {
        if now < self.sends_until {
            return None;
        }
        // A busy line is looked at again at a tick. A frame that has come in is first taken by the receiving
        // task.
        let taken_at = self.incoming.end + RECEIVE;
        if now < taken_at {
            let is_busy = now < self.incoming.end;
            self.end.is_awake = false;
            self.alarm = Some(if is_busy { clock.tick(self.incoming.end) + TICK } else { taken_at });
            return None;
        }
        let flight = self.sender.poll(clock.ticks(now), &mut self.end).map(|frame| {
            let wire = Wire::of(frame);
            let span = now + SEND..now + SEND + wire.cycles();
            Flight { wire, span, shared: None }
        });
        if let Some(Flight { span, .. }) = &flight {
            self.sender.sent(clock.ticks(span.end + SENT));
            self.sends_until = span.end;
            self.sent = [span.clone(), self.sent[0].clone()];
        }
        // If a frame goes out, other work follows at its end.
        self.end.is_awake = flight.is_some() && self.end.has_work();
        self.alarm = self.sender.poll_at().map(|at| clock.cycle(at, now));
        flight
    }

    /// Deals with a frame as the receiving task does, at a dock whose latch may be open. `deliver` hands a
    /// message on.
    pub fn receive(
        &mut self,
        ticks: u16,
        wire: &Wire,
        is_open: bool,
        deliver: impl FnMut(Message) -> Result<(), Undelivered>,
    ) {
        let end = &mut self.end;
        self.receiver.receive(ticks, wire.frame(), &mut Delivering { end, is_open, deliver });
    }
}

impl End {
    /// Whether there is anything to be sent that the sender does not know of.
    fn has_work(&self) -> bool {
        self.ack_due.is_some() || !self.mailbox.is_empty()
    }
}

impl Shared for End {
    fn endpoint<R>(&mut self, work: impl FnOnce(&mut Endpoint) -> R) -> R {
        work(&mut self.endpoint)
    }

    fn count(&mut self, what: Counted) {
        let count = self.counters.of(what);
        count.set(count.get().wrapping_add(1));
    }
}

impl Departing for End {
    type Letter = Letter;

    fn take_ack_due(&mut self) -> Option<Label> {
        self.ack_due.take()
    }

    fn take_message(&mut self) -> Option<Letter> {
        self.mailbox.pop_front()
    }
}

/// An end, and where its messages go.
struct Delivering<'a, Deliver> {
    end: &'a mut End,
    is_open: bool,
    deliver: Deliver,
}

impl<Deliver> Shared for Delivering<'_, Deliver> {
    fn endpoint<R>(&mut self, work: impl FnOnce(&mut Endpoint) -> R) -> R {
        self.end.endpoint(work)
    }

    fn count(&mut self, what: Counted) {
        self.end.count(what);
    }
}

impl<Deliver: FnMut(Message) -> Result<(), Undelivered>> Arriving for Delivering<'_, Deliver> {
    fn deliver(&mut self, message: Message) -> Result<(), Undelivered> {
        (self.deliver)(message)
    }

    fn acknowledge(&mut self, label: Label) {
        self.end.ack_due = Some(label);
        self.wake_sender();
    }

    fn wake_sender(&mut self) {
        self.end.is_awake = true;
    }

    fn is_open(&self) -> bool {
        self.is_open
    }
}
