extern crate std;
use std::collections::VecDeque;
use std::vec::Vec;

use super::super::backoff::LONGEST;
use super::*;
use crate::dock::Dock;
use crate::message::{Address, Letter, Message};

const RETRY_LIMIT: u8 = 2;

/// What a sender works on, without a kernel.
struct Desk {
    endpoint: Endpoint,
    ack_due: Option<Label>,
    mailbox: VecDeque<Letter>,
    counted: Vec<Counted>,
}

impl Shared for Desk {
    fn endpoint<R>(&mut self, work: impl FnOnce(&mut Endpoint) -> R) -> R {
        work(&mut self.endpoint)
    }

    fn count(&mut self, what: Counted) {
        self.counted.push(what);
    }
}

impl Departing for Desk {
    type Letter = Letter;

    fn take_ack_due(&mut self) -> Option<Label> {
        self.ack_due.take()
    }

    fn take_message(&mut self) -> Option<Letter> {
        self.mailbox.pop_front()
    }
}

/// What went out, in short.
#[derive(Debug, PartialEq, Eq)]
enum Sent {
    Ack,
    Data(u8),
    Datagram(u8),
}
use Sent::{Ack, Data, Datagram};

/// How long a frame is on the wire, in ticks.
const FRAME: Ticks = 2;

struct Line {
    sender: Sender<Letter>,
    desk: Desk,
    now: Ticks,
    /// The label of the last message that went out.
    label: Option<Label>,
}

impl Line {
    /// A line whose clock wraps soon.
    fn new() -> Line {
        let endpoint = Endpoint::new(Dock::Back, 7, RETRY_LIMIT);
        let desk = Desk { endpoint, ack_due: None, mailbox: VecDeque::new(), counted: Vec::new() };
        Line { sender: Sender::new(7), desk, now: 65_530, label: None }
    }

    fn put(&mut self, number: u8, kind: Kind) {
        let (to, from) = (Address::beyond(Dock::Back, TaskCode::HORMONE), Address::here(TaskCode::HORMONE));
        let payload = [number];
        let message = Message::of_kind(to, from, &payload, kind).expect("it is short");
        self.desk.mailbox.push_back(Letter::of(message));
    }

    /// Sends one frame, if one is to go out now.
    fn step(&mut self) -> Option<Sent> {
        let sent = match self.sender.poll(self.now, &mut self.desk)? {
            Frame::Ack(_) => Ack,
            Frame::Data { label, payload, .. } => {
                self.label = Some(label);
                Data(payload[0])
            }
            Frame::Datagram { payload, .. } => Datagram(payload[0]),
        };
        self.now = self.now.wrapping_add(FRAME);
        self.sender.sent(self.now);
        Some(sent)
    }

    /// Sends what there is to be sent now.
    fn run(&mut self) -> Vec<Sent> {
        std::iter::from_fn(|| self.step()).collect()
    }

    /// Waits until the sender wants to be polled. Returns for how many ticks; 0 if it does not want that.
    fn wait(&mut self) -> Ticks {
        let waited = self.sender.poll_at().map_or(0, |at| at.wrapping_sub(self.now));
        self.now = self.now.wrapping_add(waited);
        waited
    }

    /// The neighbour acknowledges the last message.
    fn acknowledged(&mut self) {
        let ack = Frame::Ack(self.label.expect("a message went out"));
        assert_eq!(self.desk.endpoint.on_frame(ack), super::super::endpoint::Arrival::Delivered);
    }

    fn counted(&self, what: Counted) -> usize {
        self.desk.counted.iter().filter(|counted| **counted == what).count()
    }
}

#[test]
fn nothing_is_sent_of_nothing() {
    let mut line = Line::new();
    assert_eq!((line.run(), line.wait()), ([].into(), 0));
}

#[test]
fn an_ack_goes_before_a_message_and_does_not_wait_for_one_under_way() {
    let mut line = Line::new();
    let ack = Some(Endpoint::new(Dock::Front, 9, RETRY_LIMIT).sender.start());
    line.put(1, Kind::Lasting);
    line.desk.ack_due = ack;
    assert_eq!(line.run(), [Ack, Data(1)]);
    line.desk.ack_due = ack;
    assert_eq!(line.step(), Some(Ack));
    assert_eq!(line.counted(Counted::FramesSent), 3);
}

#[test]
fn a_message_is_repeated_when_its_ack_is_overdue_and_then_given_up_for_the_next() {
    let mut line = Line::new();
    line.put(1, Kind::Lasting);
    line.put(2, Kind::Lasting);
    assert_eq!(line.run(), [Data(1)]);
    assert_eq!(line.wait(), ACK_TIMEOUT, "from the frame's end");
    line.now = line.now.wrapping_sub(1);
    assert_eq!(line.run(), [], "not a tick sooner");
    line.now = line.now.wrapping_add(1);
    assert_eq!(line.run(), [Data(1)]);
    assert_eq!(line.wait(), ACK_TIMEOUT, "nothing is added the first time");
    assert_eq!(line.run(), [Data(1)]);
    let waits: Vec<Ticks> = (0..2).map(|_| line.wait()).collect();
    assert!((ACK_TIMEOUT..=ACK_TIMEOUT + Ticks::from(LONGEST)).contains(&waits[0]), "{waits:?}");
    assert_eq!(line.run(), [Data(2)]);
    assert_eq!([line.counted(Counted::Retries), line.counted(Counted::GaveUp)], [2, 1]);
}

#[test]
fn an_overdue_ack_is_noticed_however_late_somebody_looks() {
    for late in [0, 1, 1_000, kernel::LONGEST] {
        let mut line = Line::new();
        line.put(1, Kind::Lasting);
        assert_eq!(line.run(), [Data(1)]);
        line.wait();
        line.now = line.now.wrapping_add(late);
        assert_eq!(line.run(), [Data(1)], "{late}");
    }
}

#[test]
fn what_is_acknowledged_makes_way_at_once() {
    let mut line = Line::new();
    line.put(1, Kind::Lasting);
    line.put(2, Kind::Lasting);
    assert_eq!(line.run(), [Data(1)]);
    line.acknowledged();
    assert_eq!(line.run(), [Data(2)]);
    line.acknowledged();
    assert_eq!((line.run(), line.wait()), ([].into(), 0));
    assert_eq!(line.counted(Counted::Retries), 0);
}

#[test]
fn of_the_latest_in_a_row_the_last_goes_out_and_what_follows_keeps_its_place() {
    let mut line = Line::new();
    for (number, kind) in
        [(1, Kind::Latest), (2, Kind::Latest), (3, Kind::Lasting), (4, Kind::Latest), (5, Kind::Latest)]
    {
        line.put(number, kind);
    }
    for expected in [2, 3, 5] {
        assert_eq!(line.run(), [Data(expected)]);
        line.acknowledged();
    }
    assert_eq!(line.run(), []);
    assert_eq!(line.counted(Counted::Replaced), 2);
}

#[test]
fn a_datagram_waits_for_its_moment_and_the_next_one_drives_it_out() {
    let mut line = Line::new();
    let mut waits = Vec::new();
    for number in 0..100 {
        line.put(number, Kind::Datagram);
        let sent = line.run();
        if sent.is_empty() {
            waits.push(line.wait());
            assert_eq!(line.run(), [Datagram(number)]);
        } else {
            assert_eq!(sent, [Datagram(number)], "its moment is now");
        }
    }
    assert!(waits.iter().all(|wait| (1..8).contains(wait)) && waits.len() > 70, "{waits:?}");
    loop {
        line.put(1, Kind::Datagram);
        line.put(2, Kind::Datagram);
        if line.step() == Some(Datagram(1)) && line.sender.poll_at().is_some() {
            break;
        }
        line.now = line.now.wrapping_add(10);
        line.run();
    }
    line.wait();
    assert_eq!(line.run(), [Datagram(2)]);
}

#[test]
fn a_datagram_waits_behind_a_message_until_that_has_arrived() {
    let mut line = Line::new();
    line.put(1, Kind::Lasting);
    line.put(2, Kind::Datagram);
    assert_eq!(line.run(), [Data(1)]);
    line.acknowledged();
    line.run();
    line.wait();
    line.run();
    assert_eq!(line.desk.counted, [Counted::FramesSent; 2]);
}

/// While light that is no frame keeps the line busy, the sender is not polled.
#[test]
fn what_a_busy_line_has_held_up_for_long_goes_out_as_soon_as_it_is_free() {
    for kind in [Kind::Datagram, Kind::Lasting] {
        for held_up in [LONGEST.into(), 30_000, 33_000, 40_000, 65_000] {
            let mut line = Line::new();
            line.put(1, kind);
            // A datagram whose back-off is 0 goes out at once.
            while line.run() == [Datagram(1)] {
                line.put(1, kind);
            }
            line.now = line.now.wrapping_add(ACK_TIMEOUT + held_up);
            let sent = if kind == Kind::Lasting { Data(1) } else { Datagram(1) };
            assert_eq!(line.step(), Some(sent), "{kind:?}, {held_up}");
        }
    }
}
