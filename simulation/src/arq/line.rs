//! Two endpoints, the line between them, and the judge of what arrives.

use std::collections::VecDeque;

use tasks::dock::Dock;
use tasks::link::arq::Timeout;
use tasks::link::cobs::WireBuffer;
use tasks::link::endpoint::{Arrival, Endpoint};
use tasks::link::frame::{Frame, Label};
use tasks::link::sizes::MAX_WIRE;
use tasks::message::TaskCode;

const TO: TaskCode = TaskCode::HORMONE;

/// The number of a message, counted up by its sender through resets.
pub type Number = u16;

/// The outcome of an action, for callers that count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    Nothing,
    /// A message was taken.
    Received,
    /// The sender has learnt that its message was taken.
    Delivered,
    /// The sender has learnt that its message has to be given up.
    GaveUp,
}

/// An outcome that no line may bring about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Violation {
    /// A message came back to its sender as if from the neighbour.
    OwnMessage,
    /// The same receiver, not reset in between, got it twice, or an older one after a newer one.
    NotInOrder,
    /// The sender was told that it arrived, and it never did.
    NeverArrived,
    /// Something arrived that was never sent.
    Forged,
}

/// One end.
#[derive(Clone, PartialEq, Eq, Hash)]
pub struct End {
    pub dock: Dock,
    /// The seed that a reset begins with: an epoch after the last one used.
    seed: u16,
    retry_limit: u8,
    endpoint: Endpoint,
    outstanding: Option<(Number, Vec<u8>)>,
    /// The number of the next message to be sent.
    pub next: Number,
    /// Frames under way to this end.
    pub line: VecDeque<Vec<u8>>,
    /// Bytes that came without a delimiter yet.
    pending: Vec<u8>,
    /// The last two frames that were sent since the last arrival or time-out: these may still come back.
    /// Light takes no time, so a reflection is heard before the neighbour's answer, but the receiving task
    /// may look at it after the next frame went out.
    pub echoes: VecDeque<Vec<u8>>,
    /// The newest message taken since the last reset, and ever.
    newest: Option<Number>,
    newest_ever: Option<Number>,
    /// The messages taken among the last 64, about which the sender may still learn: a bit for each.
    taken: u64,
}

impl End {
    /// An end at power-up. `seed` decides its epochs; a message is given up after `retry_limit` repetitions.
    pub fn new(dock: Dock, seed: u16, retry_limit: u8) -> End {
        End {
            dock,
            seed,
            retry_limit,
            endpoint: Endpoint::new(dock, seed, retry_limit),
            outstanding: None,
            next: 0,
            line: VecDeque::new(),
            pending: Vec::new(),
            echoes: VecDeque::new(),
            newest: None,
            newest_ever: None,
            taken: 0,
        }
    }

    /// Whether a message is under way.
    pub fn is_busy(&self) -> bool {
        self.outstanding.is_some()
    }
}

/// Both ends.
#[derive(Clone, PartialEq, Eq, Hash)]
pub struct Link {
    pub ends: [End; 2],
    /// How many frames the line holds in each direction; more are lost.
    capacity: usize,
}

impl Link {
    /// A line that is empty.
    pub fn new(ends: [End; 2], capacity: usize) -> Link {
        Link { ends, capacity }
    }

    /// `end` takes up its next message, in place of one outstanding.
    pub fn start(&mut self, end: usize) {
        let this = &mut self.ends[end];
        let number = this.next;
        this.next += 1;
        let [high, low] = number.to_be_bytes();
        let label = this.endpoint.sender.start();
        let [step, _] = this.seed.to_be_bytes();
        this.seed = u16::from_be_bytes([step, label.signature.epoch.wrapping_add(step | 1)]);
        let wire = encode(Frame::Data { label, to: TO, payload: &[end as u8, high, low] });
        this.outstanding = Some((number, wire.clone()));
        self.send(end, wire);
    }

    /// The time for an ACK is up at `end`.
    pub fn time_out(&mut self, end: usize) -> Event {
        let this = &mut self.ends[end];
        this.echoes.clear();
        match this.endpoint.sender.on_timeout() {
            None => Event::Nothing,
            Some(Timeout::Retransmit) => {
                let (_, wire) = this.outstanding.clone().expect("a sender repeats what it has");
                self.send(end, wire);
                Event::Nothing
            }
            Some(Timeout::GaveUp) => {
                this.outstanding = None;
                Event::GaveUp
            }
        }
    }

    /// The older of the frames that `end` sent comes back to it.
    pub fn reflect(&mut self, end: usize) -> Result<Event, Violation> {
        match self.ends[end].echoes.pop_front() {
            Some(wire) => self.hear(end, &wire, true),
            None => Ok(Event::Nothing),
        }
    }

    /// `end` loses its memory, but for the seed.
    pub fn reset(&mut self, end: usize) {
        let this = &mut self.ends[end];
        *this = End {
            next: this.next,
            newest_ever: this.newest_ever,
            taken: this.taken,
            ..End::new(this.dock, this.seed, this.retry_limit)
        };
    }

    /// These bytes arrive at `end`, which has room for a message or not.
    pub fn arrive(&mut self, end: usize, bytes: &[u8], room: bool) -> Result<Event, Violation> {
        self.ends[end].echoes.clear();
        self.hear(end, bytes, room)
    }

    fn hear(&mut self, end: usize, bytes: &[u8], room: bool) -> Result<Event, Violation> {
        let mut event = Event::Nothing;
        for byte in bytes {
            self.ends[end].pending.push(*byte);
            if *byte == 0 {
                let mut wire = std::mem::take(&mut self.ends[end].pending);
                if wire.len() <= MAX_WIRE
                    && let Ok(frame) = Frame::decode(&mut wire)
                {
                    event = self.frame(end, frame, room)?;
                }
            }
        }
        Ok(event)
    }

    fn frame(&mut self, end: usize, frame: Frame, room: bool) -> Result<Event, Violation> {
        match self.ends[end].endpoint.on_frame(frame) {
            Arrival::Message { label, to: TO, payload } if room => {
                self.take(end, label, payload)?;
                Ok(Event::Received)
            }
            Arrival::Duplicate(label) => {
                self.send(end, encode(Frame::Ack(label)));
                Ok(Event::Nothing)
            }
            Arrival::Delivered => {
                let outstanding = self.ends[end].outstanding.take();
                let (number, _) = outstanding.ok_or(Violation::Forged)?;
                let other = &self.ends[1 - end];
                let age = other.newest_ever.and_then(|newest| newest.checked_sub(number));
                match age.and_then(|age| other.taken.checked_shr(age.into())) {
                    Some(taken) if taken & 1 == 1 => Ok(Event::Delivered),
                    _ => Err(Violation::NeverArrived),
                }
            }
            Arrival::Datagram { .. } => Err(Violation::Forged),
            Arrival::Message { .. } | Arrival::StaleAck | Arrival::Reflection => Ok(Event::Nothing),
        }
    }

    fn take(&mut self, end: usize, label: Label, payload: &[u8]) -> Result<(), Violation> {
        let [origin, high, low] = *payload else {
            return Err(Violation::Forged);
        };
        let number = Number::from_be_bytes([high, low]);
        if usize::from(origin) == end {
            return Err(Violation::OwnMessage);
        }
        if usize::from(origin) != 1 - end || number >= self.ends[1 - end].next {
            return Err(Violation::Forged);
        }
        let this = &mut self.ends[end];
        // A reset receiver may get the newest message once more: it has forgotten it, and so has
        // the module. It gets none that is older.
        if this.newest.is_some_and(|newest| number <= newest)
            || this.newest_ever.is_some_and(|newest| number < newest)
        {
            return Err(Violation::NotInOrder);
        }
        let advance = number - this.newest_ever.unwrap_or(number);
        this.taken = this.taken.checked_shl(advance.into()).unwrap_or(0) | 1;
        this.newest = Some(number);
        this.newest_ever = Some(number);
        this.endpoint.accept(label);
        self.send(end, encode(Frame::Ack(label)));
        Ok(())
    }

    fn send(&mut self, end: usize, wire: Vec<u8>) {
        let echoes = &mut self.ends[end].echoes;
        if echoes.len() == 2 {
            echoes.pop_front();
        }
        echoes.push_back(wire.clone());
        let line = &mut self.ends[1 - end].line;
        if line.len() < self.capacity {
            line.push_back(wire);
        }
    }
}

fn encode(frame: Frame) -> Vec<u8> {
    let mut wire = WireBuffer::new();
    frame.encode(&mut wire).expect("the payload is short");
    wire.bytes().to_vec()
}
