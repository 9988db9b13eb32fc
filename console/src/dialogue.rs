//! A terminal asks, the inspectors answer, the terminal gets its text. The dialogue decides which message is
//! sent when, and to which of them.

use super::line::Line;
use super::report::{Next, Report};
use super::request::{Number, PIECE, Request};
use crate::question::{Question, words};
use tasks::dock::DockSet;
use tasks::message::{Address, MAX_PAYLOAD, Message, TaskCode};
use tasks::router::Mcu;

/// The terminal that is served, and the progress of its text.
pub struct Dialogue {
    /// The docks of the slave.
    slave: DockSet,
    /// The terminal that gets the text.
    client: Address,
    report: Option<Report>,
    line: Line,
    /// The start and the end in the line of the piece that was sent last.
    start: usize,
    end: usize,
    number: Number,
    due: Due,
    /// How often the question may still be repeated.
    tries_left: u8,
}

/// How often an unanswered question is asked: the bridge may lose it or its answer.
const TRIES: u8 = 3;

/// What the dialogue waits for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Due {
    /// The next request.
    Request,
    /// Room for the piece.
    Piece,
    /// Room for a question to this MCU.
    Question(Mcu, Question),
    /// The answer to that question.
    Answer(Mcu, Question),
}

/// The inspector of an MCU.
const fn inspector(mcu: Mcu) -> Address {
    Address::here(match mcu {
        Mcu::Master => TaskCode::MASTER_INSPECTOR,
        Mcu::Slave => TaskCode::SLAVE_INSPECTOR,
    })
}

impl Dialogue {
    /// A dialogue without a client. `slave` has the docks of that MCU.
    pub const fn new(slave: DockSet) -> Dialogue {
        Dialogue {
            slave,
            client: Address::here(TaskCode::CONSOLE),
            report: None,
            line: Line::new(),
            start: 0,
            end: 0,
            number: Number::FIRST,
            due: Due::Request,
            tries_left: 0,
        }
    }

    /// Takes a message to the console. Returns whether it was a valid request, or the awaited answer.
    ///
    /// A new text replaces the one under way, even if another terminal asked for that.
    pub fn receive(&mut self, from: Address, payload: &[u8]) -> bool {
        if let Due::Answer(mcu, question) = self.due
            && from == inspector(mcu)
        {
            let Some(words) = words(question, payload) else { return false };
            if let Some(report) = &mut self.report {
                report.take(words);
            }
            self.go_on();
            return true;
        }
        // A late answer is no request.
        match Request::from_payload(payload).filter(|_| from.dock().is_some()) {
            Some(Request::Begin(topic)) => {
                self.client = from;
                self.report = Some(Report::new(topic, self.slave));
                self.line.clear();
                (self.start, self.end) = (0, 0);
                self.number = Number::FIRST;
                self.go_on();
                true
            }
            Some(Request::Next(number)) if from == self.client && self.report.is_some() => {
                if self.due != Due::Request {
                    return number == self.number || number.next() == self.number;
                }
                if number == self.number && self.start < self.end {
                    self.number = number.next();
                    self.start = self.end;
                    self.go_on();
                    true
                } else if number.next() == self.number {
                    self.due = Due::Piece;
                    true
                } else {
                    false
                }
            }
            _ => false,
        }
    }

    /// The time for an answer is up.
    pub fn miss_answer(&mut self) {
        let (Due::Answer(mcu, question), Some(report)) = (self.due, &mut self.report) else { return };
        if self.tries_left > 0 {
            self.tries_left -= 1;
            self.due = Due::Question(mcu, question);
        } else {
            report.miss();
            self.go_on();
        }
    }

    /// Whether an answer is awaited.
    pub fn awaits_answer(&self) -> bool {
        matches!(self.due, Due::Answer(..))
    }

    /// Hands the message that is due to `send`, which returns whether there was room for it.
    pub fn send(&mut self, send: impl FnOnce(Message) -> bool) {
        let from = Address::here(TaskCode::CONSOLE);
        match self.due {
            Due::Piece => {
                let mut payload = [0; MAX_PAYLOAD];
                let mut length = 0;
                let text = self.line.text().get(self.start..self.end).unwrap_or(&[]);
                for (slot, byte) in payload.iter_mut().zip([self.number.byte()].iter().chain(text)) {
                    *slot = *byte;
                    length += 1;
                }
                let payload = payload.get(..length).unwrap_or(&[]);
                if Message::new(self.client, from, payload).is_ok_and(send) {
                    self.due = Due::Request;
                }
            }
            Due::Question(mcu, question) => {
                if Message::new(inspector(mcu), from, &question.to_payload()).is_ok_and(send) {
                    self.due = Due::Answer(mcu, question);
                }
            }
            Due::Request | Due::Answer(..) => {}
        }
    }

    /// Whether a message waits for room.
    pub fn has_mail(&self) -> bool {
        matches!(self.due, Due::Piece | Due::Question(..))
    }

    /// Makes the next piece, or the question that has to be asked first.
    fn go_on(&mut self) {
        let Some(report) = &mut self.report else { return };
        if self.start == self.line.text().len() {
            self.start = 0;
            if let Next::Ask(mcu, question) = report.next(&mut self.line) {
                self.end = 0;
                self.tries_left = TRIES - 1;
                self.due = Due::Question(mcu, question);
                return;
            }
        }
        self.end = self.line.text().len().min(self.start + PIECE);
        self.due = Due::Piece;
    }
}
