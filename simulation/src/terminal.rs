//! A terminal at a module's dock: the other end of the [console].

use console::request::{Number, Request, Topic, piece};
use tasks::dock::Dock;
use tasks::link::cobs::WireBuffer;
use tasks::link::frame::{Frame, Label, Turn};
use tasks::link::signature::Signature;
use tasks::message::TaskCode;

use crate::wiring::Face;

/// A request that is not acknowledged after so many milliseconds is sent again.
const ACK_TIMEOUT: u64 = 30;

/// A request that was acknowledged but brought no piece in so many milliseconds is sent again.
const PATIENCE: u64 = 250;

/// When nothing new has come for so many milliseconds, the text is asked for from its beginning: the module
/// may have been reset.
const STUCK: u64 = 2000;

/// After so many milliseconds of silence the rest of a frame comes no more.
const SILENCE: u64 = 10;

/// The answer of a console.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Transcript {
    /// When it was asked, in cycles since power-up, and where.
    pub at: u64,
    pub face: Face,
    pub text: String,
    /// Whether the text is all that it has to tell.
    pub is_complete: bool,
}

/// Asks a module's console for a text. It hears bytes as they come in at a dock, and says what is to be sent
/// there.
pub struct Terminal {
    topic: Topic,
    request: Request,
    text: String,
    is_complete: bool,
    /// The number of the piece that is waited for.
    expected: Number,
    /// The bytes of a frame that have come, and when the last one came.
    wire: Vec<u8>,
    heard_at: u64,
    /// The label of the request.
    label: Label,
    /// When it is sent, or sent again, in milliseconds, and when something new came last.
    due: u64,
    news_at: u64,
}

impl Terminal {
    /// A terminal that asks for a text about `topic` from `now` on, in milliseconds of any clock.
    pub fn new(topic: Topic, now: u64) -> Self {
        let signature = Signature { dock: Dock::Front, epoch: 0 };
        Terminal {
            topic,
            request: Request::Begin(topic),
            text: String::new(),
            is_complete: false,
            expected: Number::FIRST,
            wire: Vec::new(),
            heard_at: now,
            label: Label { signature, turn: Turn::First },
            due: now,
            news_at: now,
        }
    }

    /// The part of the text that has come.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether the text is complete.
    pub fn is_complete(&self) -> bool {
        self.is_complete
    }

    /// Takes what has come in until `now`, in milliseconds, and returns what is to be sent.
    pub fn step(&mut self, now: u64, bytes: impl IntoIterator<Item = u8>) -> Vec<u8> {
        let mut sent = Vec::new();
        for byte in bytes {
            self.heard_at = now;
            self.wire.push(byte);
            if byte == 0 {
                let mut wire = std::mem::take(&mut self.wire);
                if let Ok(frame) = Frame::decode(&mut wire) {
                    self.take(now, frame, &mut sent);
                }
            }
        }
        if now > self.heard_at + SILENCE {
            self.wire.clear();
        }
        // Light carries one frame at a time.
        if !self.is_complete && now >= self.due && self.wire.is_empty() {
            self.ask(now, &mut sent);
        }
        sent
    }

    fn take(&mut self, now: u64, frame: Frame, sent: &mut Vec<u8>) {
        match frame {
            Frame::Ack(label) if label == self.label => self.due = now + PATIENCE,
            Frame::Ack(_) => {}
            // A transceiver hears itself.
            Frame::Data { label, .. } if label == self.label => {}
            Frame::Datagram { signature, .. } => self.face(signature.dock),
            Frame::Data { label, to, payload } => {
                self.face(label.signature.dock);
                if to == TaskCode::CONSOLE {
                    send(Frame::Ack(label), sent);
                    self.read(now, payload);
                }
            }
        }
    }

    /// The terminal is at this dock, which takes a frame that bears its own number and epoch for a
    /// reflection.
    fn face(&mut self, dock: Dock) {
        self.label.signature.dock = if dock == Dock::Front { Dock::Back } else { Dock::Front };
    }

    fn read(&mut self, now: u64, payload: &[u8]) {
        // Else it is a piece that came before.
        if let Some((number, text)) = piece(payload)
            && number == self.expected
            && !self.is_complete
        {
            if matches!(self.request, Request::Begin(_)) {
                // A text that was asked for anew replaces the part that came before.
                self.text.clear();
            }
            self.text.extend(text.iter().map(|&character| char::from(character)));
            self.is_complete = text.is_empty();
            self.expected = number.next();
            self.request(Request::Next(number), now);
        }
    }

    /// Asks for something else.
    fn request(&mut self, request: Request, now: u64) {
        self.request = request;
        // Another epoch each time, or it would be taken for a repetition.
        self.label.signature.epoch = self.label.signature.epoch.wrapping_add(1);
        (self.due, self.news_at) = (now, now);
    }

    fn ask(&mut self, now: u64, sent: &mut Vec<u8>) {
        if now > self.news_at + STUCK {
            self.expected = Number::FIRST;
            self.request(Request::Begin(self.topic), now);
        }
        self.request.with_payload(|payload| {
            send(Frame::Data { label: self.label, to: TaskCode::CONSOLE, payload }, sent);
        });
        self.due = now + ACK_TIMEOUT;
    }
}

fn send(frame: Frame, sent: &mut Vec<u8>) {
    let mut wire = WireBuffer::new();
    if frame.encode(&mut wire).is_ok() {
        sent.extend(wire.bytes());
    }
}
