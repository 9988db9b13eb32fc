//! Which frame leaves a dock next: one message at a time, repeated until the neighbour acknowledges it or the
//! ARQ gives up.
//!
//! The caller, which has a line and a clock, drives it:
//!
//! 1. While the line is free, [`poll`](Sender::poll). Transmit what that returns, then say
//!    [`sent`](Sender::sent), and begin again.
//! 2. When there is nothing to transmit, wait until [`poll_at`](Sender::poll_at), until a message comes into
//!    the mailbox, or until the receiver [wakes](super::receiver::Arriving::wake_sender) it.

use kernel::Ticks;

use super::arq::Timeout;
use super::backoff::{self, Backoff};
use super::counters::Counted;
use super::endpoint::Endpoint;
use super::frame::{Frame, Label};
use super::signature::Signature;
use crate::message::{Held, Kind, TaskCode};

/// How long an ACK may take to begin after the end of the message's frame, in ticks of 1 ms. A neighbour that
/// heard the message was not sending, so the ACK is the next frame that it sends, mostly within 0.4 ms. Once
/// a frame comes in, its end is waited for.
pub const ACK_TIMEOUT: Ticks = 2;

/// No frame waits for its moment for longer than this, in ticks of 1 ms.
const LONGEST_WAIT: Ticks = ACK_TIMEOUT + backoff::LONGEST as Ticks;

/// What sender and receiver of a dock both work on.
pub trait Shared {
    /// Works on the dock's end of the link.
    fn endpoint<R>(&mut self, work: impl FnOnce(&mut Endpoint) -> R) -> R;

    /// Counts one more of this.
    fn count(&mut self, what: Counted);
}

/// What a sender works on.
pub trait Departing: Shared {
    /// The holder of a letter until its message has arrived.
    type Letter: Held;

    /// The ACK that the receiver has asked for, once.
    fn take_ack_due(&mut self) -> Option<Label>;

    /// The first message of the mailbox, if there is one.
    fn take_message(&mut self) -> Option<Self::Letter>;
}

/// The sending half of a dock's link.
pub struct Sender<Letter> {
    backoff: Backoff,
    outstanding: Option<Outstanding<Letter>>,
    /// Whether the message under way was repeated before.
    is_repeated: bool,
    waiting: Option<Waiting<Letter>>,
    /// The message that follows the one under way.
    follower: Option<Letter>,
    /// The datagram that is being transmitted.
    leaving: Option<Letter>,
}

/// A message on its way, until it is acknowledged or given up.
struct Outstanding<Letter> {
    message: Letter,
    label: Label,
    /// When the ACK is overdue; while the frame is being transmitted, how long after its end that will be.
    deadline: Ticks,
    is_leaving: bool,
}

/// A datagram that waits for its moment, a back-off later. Two ends of a half-duplex line that begin at once
/// do not hear each other, and datagrams are not repeated: without the wait, probes of modules in step would
/// be lost again and again.
struct Waiting<Letter> {
    datagram: Letter,
    moment: Ticks,
}

/// The next frame to go out.
enum Departure {
    Ack(Label),
    Message,
    Datagram(Signature),
}

impl<Letter: Held> Sender<Letter> {
    /// A sender of nothing yet. `seed` should differ from dock to dock and from module to module.
    pub const fn new(seed: u16) -> Self {
        Sender {
            backoff: Backoff::new(seed),
            outstanding: None,
            is_repeated: false,
            waiting: None,
            follower: None,
            leaving: None,
        }
    }

    /// The frame that goes out at `now`, if any does. ACKs go first: a neighbour waits for them.
    pub fn poll(&mut self, now: Ticks, dock: &mut impl Departing<Letter = Letter>) -> Option<Frame<'_>> {
        let departure = self.departure(now, dock)?;
        dock.count(Counted::FramesSent);
        match departure {
            Departure::Ack(label) => Some(Frame::Ack(label)),
            Departure::Message => {
                let Outstanding { message, label, .. } = self.outstanding.as_ref()?;
                let (to, payload) = content(message);
                Some(Frame::Data { label: *label, to, payload })
            }
            Departure::Datagram(signature) => {
                let (to, payload) = content(self.leaving.as_ref()?);
                Some(Frame::Datagram { signature, to, payload })
            }
        }
    }

    /// What [`poll`](Self::poll) returned was transmitted: its last stop bit is on the wire at `now`.
    pub fn sent(&mut self, now: Ticks) {
        self.leaving = None;
        if let Some(outstanding) = &mut self.outstanding
            && outstanding.is_leaving
        {
            outstanding.is_leaving = false;
            outstanding.deadline = now.wrapping_add(outstanding.deadline);
        }
    }

    /// When to poll again even if nothing comes; `None` if never. Of use once [`poll`](Self::poll) has
    /// returned `None`.
    pub fn poll_at(&self) -> Option<Ticks> {
        match &self.outstanding {
            Some(outstanding) => Some(outstanding.deadline),
            None => self.waiting.as_ref().map(|waiting| waiting.moment),
        }
    }

    fn departure(&mut self, now: Ticks, dock: &mut impl Departing<Letter = Letter>) -> Option<Departure> {
        if let Some(label) = dock.take_ack_due() {
            return Some(Departure::Ack(label));
        }
        if self.outstanding.is_some() && self.is_repetition_due(now, dock) {
            return Some(Departure::Message);
        }
        while self.outstanding.is_none() {
            let Some(message) = self.next(dock) else { return self.datagram(now, dock) };
            let departure = self.begin(now, message, dock);
            if departure.is_some() {
                return departure;
            }
        }
        None
    }

    /// The next message to be sent: the newest of several in a row of which only the newest matters.
    fn next(&mut self, dock: &mut impl Departing<Letter = Letter>) -> Option<Letter> {
        let mut next = self.follower.take().or_else(|| dock.take_message())?;
        while next.letter().kind() == Kind::Latest {
            self.follower = dock.take_message();
            let Some(newer) = self.follower.take_if(|after| after.letter().replaces(next.letter())) else {
                break;
            };
            next = newer;
            dock.count(Counted::Replaced);
        }
        Some(next)
    }

    /// Sends a message for the first time. A datagram waits instead, and the one that waited before is sent.
    fn begin(&mut self, now: Ticks, message: Letter, dock: &mut impl Shared) -> Option<Departure> {
        if message.letter().kind() == Kind::Datagram {
            let moment = now.wrapping_add(self.backoff.next_ms().into());
            let before = self.waiting.replace(Waiting { datagram: message, moment })?;
            return Some(self.begin_datagram(before, dock));
        }
        let label = dock.endpoint(|endpoint| endpoint.sender.start());
        self.is_repeated = false;
        self.outstanding = Some(Outstanding { message, label, deadline: ACK_TIMEOUT, is_leaving: true });
        Some(Departure::Message)
    }

    /// Sends the datagram that waits, if its moment has come.
    fn datagram(&mut self, now: Ticks, dock: &mut impl Shared) -> Option<Departure> {
        let waiting = self.waiting.take_if(|waiting| is_due(waiting.moment, now))?;
        Some(self.begin_datagram(waiting, dock))
    }

    fn begin_datagram(&mut self, waiting: Waiting<Letter>, dock: &mut impl Shared) -> Departure {
        self.leaving = Some(waiting.datagram);
        Departure::Datagram(dock.endpoint(Endpoint::sign_datagram))
    }

    /// Checks whether the outstanding message has arrived or its time is up. Returns whether it goes out once
    /// more.
    fn is_repetition_due(&mut self, now: Ticks, dock: &mut impl Shared) -> bool {
        let Some(outstanding) = &mut self.outstanding else { return false };
        let is_late = is_due(outstanding.deadline, now);
        let timeout = dock.endpoint(|endpoint| match (endpoint.sender.is_busy(), is_late) {
            (true, false) => Some(None),
            (true, true) => endpoint.sender.on_timeout().map(Some),
            (false, _) => None,
        });
        match timeout {
            Some(None) => false,
            Some(Some(Timeout::Retransmit)) => {
                dock.count(Counted::Retries);
                // Two ends that collide again repeat after the same time, so the wait gets a random part
                // then.
                let part = if self.is_repeated { self.backoff.next_ms().into() } else { 0 };
                self.is_repeated = true;
                outstanding.deadline = ACK_TIMEOUT + part;
                outstanding.is_leaving = true;
                true
            }
            Some(Some(Timeout::GaveUp)) => {
                dock.count(Counted::GaveUp);
                self.outstanding = None;
                false
            }
            None => {
                self.outstanding = None;
                false
            }
        }
    }
}

/// Whether the moment for a frame has come. Light that is no frame can keep the line busy for longer than
/// half the clock's range. A moment that passed so long ago seems to lie far ahead.
fn is_due(moment: Ticks, now: Ticks) -> bool {
    moment.wrapping_sub(now).wrapping_sub(1) >= LONGEST_WAIT
}

fn content(letter: &impl Held) -> (TaskCode, &[u8]) {
    let letter = letter.letter();
    (letter.to().task(), letter.payload())
}

#[cfg(test)]
mod tests;
