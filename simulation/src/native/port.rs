//! A dock's link: what its sending and its receiving task do, over the same ARQ.

use std::collections::VecDeque;
use std::hash::{Hash, Hasher};
use std::ops::Range;

use tasks::dock::Dock;
use tasks::link::arq::Timeout;
use tasks::link::backoff::Backoff;
use tasks::link::counters::LinkCounters;
use tasks::link::endpoint::{Arrival, Endpoint};
use tasks::link::frame::{Frame, Label};
use tasks::link::port::{RETRY_LIMIT, ROOM};
use tasks::link::receive::SILENCE;
use tasks::link::send::ACK_TIMEOUT;
use tasks::link::signature::Signature;
use tasks::message::{Address, Kind, Letter, Message, TaskCode};

use super::time::{CHARACTER, RECEIVE, RECEIVE_ACK, SEND, SENT, TICK, ack, frame};

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
}

impl Flight {
    /// When the receiving task is through with it.
    pub fn taken_at(&self) -> u64 {
        let program = if matches!(self.wire, Wire::Ack(_)) { RECEIVE_ACK } else { RECEIVE };
        self.span.end + program
    }
}

impl Wire {
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

/// A message on its way, until it is acknowledged or given up.
struct Outstanding {
    message: Letter,
    label: Label,
    /// When the ACK is overdue.
    deadline: u64,
}

/// A datagram that waits for its moment.
struct Waiting {
    datagram: Letter,
    moment: u64,
}

pub struct Port {
    dock: Dock,
    endpoint: Endpoint,
    backoff: Backoff,
    mailbox: VecDeque<Letter>,
    ack_due: Option<Label>,
    outstanding: Option<Outstanding>,
    /// Whether the message under way was sent before.
    is_repeated: bool,
    waiting: Option<Waiting>,
    /// Until when the sending task waits for the line: the end of what it sends itself, or the tick after
    /// what comes in.
    busy_until: u64,
    /// The last frame that was sent, and the one before.
    sent: [Range<u64>; 2],
    /// The last frame of which a character came in.
    incoming: Range<u64>,
    heard_at: u64,
    pub counters: LinkCounters,
}

impl Hash for Port {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.endpoint.hash(state);
        self.ack_due.hash(state);
        self.mailbox.iter().for_each(|message| message.payload().hash(state));
        self.outstanding.as_ref().map(|outstanding| outstanding.deadline).hash(state);
        (self.busy_until, self.heard_at, self.counters.frames_sent).hash(state);
    }
}

/// What a frame brought.
pub enum Taken {
    Nothing,
    /// A message that is acknowledged once it has found room.
    Message(Label, Letter),
    Datagram(Letter),
}

impl Port {
    /// The link at `dock`, from `now` on.
    pub fn new(dock: Dock, seed: u16, now: u64) -> Self {
        Port {
            dock,
            endpoint: Endpoint::new(dock, seed, RETRY_LIMIT),
            backoff: Backoff::new(seed),
            mailbox: VecDeque::new(),
            ack_due: None,
            outstanding: None,
            is_repeated: false,
            waiting: None,
            busy_until: now,
            sent: [0..0, 0..0],
            incoming: 0..0,
            heard_at: now,
            counters: LinkCounters::default(),
        }
    }

    /// Puts a message into the sending task's mailbox. Returns whether there was room.
    pub fn put(&mut self, message: Letter) -> bool {
        let has_room = self.mailbox.len() < usize::from(ROOM);
        if has_room {
            self.mailbox.push_back(message);
        }
        has_room
    }

    /// The first character of a frame has come in.
    pub fn expect(&mut self, span: Range<u64>) {
        self.incoming = span;
    }

    /// Whether the line was drowned by what this end sent itself.
    pub fn has_drowned(&self, span: &Range<u64>) -> bool {
        self.sent.iter().any(|sent| sent.start < span.end && span.start < sent.end)
    }

    /// When the sending task has something to do; never before `now`.
    pub fn due(&self, now: u64) -> Option<u64> {
        let is_delivered = self.outstanding.is_some() && !self.endpoint.sender.is_busy();
        let is_free = self.outstanding.is_none() && !self.mailbox.is_empty();
        let due = if self.ack_due.is_some() || is_delivered || is_free {
            now
        } else if let Some(outstanding) = &self.outstanding {
            outstanding.deadline
        } else {
            self.waiting.as_ref()?.moment
        };
        Some(due.max(self.busy_until).max(now))
    }

    /// What the sending task does at `now`. Returns the frame that it begins to send.
    pub fn send(&mut self, now: u64, tick: impl Fn(u64) -> u64) -> Option<Flight> {
        if now < self.busy_until {
            return None;
        }
        if now < self.incoming.end {
            self.busy_until = tick(self.incoming.end) + TICK;
            return None;
        }
        if let Some(label) = self.ack_due.take() {
            return Some(self.transmit(now, Wire::Ack(label)));
        }
        if let Some(outstanding) = self.outstanding.take() {
            if !self.endpoint.sender.is_busy() {
                // Delivered: the next one follows below.
            } else if now < outstanding.deadline {
                self.outstanding = Some(outstanding);
                return None;
            } else {
                match self.endpoint.sender.on_timeout() {
                    Some(Timeout::Retransmit) => {
                        count(&mut self.counters.retries);
                        let part = if self.is_repeated { self.backoff.next_ms() } else { 0 };
                        self.is_repeated = true;
                        let patience = u64::from(ACK_TIMEOUT) + u64::from(part);
                        let Outstanding { message, label, .. } = outstanding;
                        return Some(self.send_data(now, label, message, patience, tick));
                    }
                    Some(Timeout::GaveUp) => count(&mut self.counters.gave_up),
                    None => {}
                }
            }
        }
        while let Some(message) = self.next_message() {
            if message.kind() != Kind::Datagram {
                let label = self.endpoint.sender.start();
                self.is_repeated = false;
                return Some(self.send_data(now, label, message, u64::from(ACK_TIMEOUT), tick));
            }
            let moment = tick(now) + u64::from(self.backoff.next_ms()) * TICK;
            if let Some(before) = self.waiting.replace(Waiting { datagram: message, moment }) {
                return Some(self.send_datagram(now, before.datagram));
            }
        }
        let waiting = self.waiting.take_if(|waiting| waiting.moment <= now)?;
        Some(self.send_datagram(now, waiting.datagram))
    }

    /// The next message to be sent, as the sending task chooses it.
    fn next_message(&mut self) -> Option<Letter> {
        let mut next = self.mailbox.pop_front()?;
        while self.mailbox.front().is_some_and(|after| after.replaces(&next)) {
            next = self.mailbox.pop_front()?;
            count(&mut self.counters.replaced);
        }
        Some(next)
    }

    fn send_datagram(&mut self, now: u64, datagram: Letter) -> Flight {
        let signature = self.endpoint.sign_datagram();
        self.transmit(now, Wire::Datagram(signature, datagram))
    }

    /// Sends a message under ARQ. Its ACK has `patience`, in ticks.
    fn send_data(
        &mut self,
        now: u64,
        label: Label,
        message: Letter,
        patience: u64,
        tick: impl Fn(u64) -> u64,
    ) -> Flight {
        let flight = self.transmit(now, Wire::Data(label, message.clone()));
        let deadline = tick(flight.span.end + SENT) + patience * TICK;
        self.outstanding = Some(Outstanding { message, label, deadline });
        flight
    }

    fn transmit(&mut self, now: u64, wire: Wire) -> Flight {
        count(&mut self.counters.frames_sent);
        let span = now + SEND..now + SEND + wire.cycles();
        self.busy_until = span.end;
        self.sent = [span.clone(), self.sent[0].clone()];
        Flight { wire, span }
    }

    /// What the receiving task does with a frame.
    pub fn receive(&mut self, now: u64, wire: &Wire) -> Taken {
        if now - self.heard_at > u64::from(SILENCE) * TICK {
            self.endpoint.forget_neighbour();
        }
        self.heard_at = now;
        count(&mut self.counters.frames_received);
        let from = |task: TaskCode| Address::beyond(self.dock, task);
        match self.endpoint.on_frame(wire.frame()) {
            Arrival::Message { label, to, payload } => {
                match Message::new(Address::here(to), from(to), payload) {
                    Ok(message) => Taken::Message(label, Letter::of(message)),
                    Err(_) => Taken::Nothing,
                }
            }
            Arrival::Datagram { to, payload } => match Message::new(Address::here(to), from(to), payload) {
                Ok(message) => Taken::Datagram(Letter::of(message)),
                Err(_) => Taken::Nothing,
            },
            Arrival::Duplicate(label) => {
                count(&mut self.counters.duplicates);
                self.ack_due = Some(label);
                Taken::Nothing
            }
            Arrival::Reflection => {
                count(&mut self.counters.reflections);
                Taken::Nothing
            }
            Arrival::Delivered | Arrival::StaleAck => Taken::Nothing,
        }
    }

    /// The message with this label has found room.
    pub fn accept(&mut self, label: Label) {
        self.endpoint.accept(label);
        self.ack_due = Some(label);
    }
}

/// Counts one more.
pub fn count(counter: &mut u16) {
    *counter = counter.wrapping_add(1);
}
