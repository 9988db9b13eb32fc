extern crate std;
use std::vec::Vec;

use super::super::endpoint::Endpoint;
use super::*;

/// What a receiver works on, without a kernel.
struct Desk {
    endpoint: Endpoint,
    /// What becomes of the next message.
    outcome: Result<(), Undelivered>,
    delivered: Vec<(Address, u8)>,
    acknowledged: Vec<Label>,
    woken: usize,
    counted: Vec<Counted>,
    is_open: bool,
}

impl Shared for Desk {
    fn endpoint<R>(&mut self, work: impl FnOnce(&mut Endpoint) -> R) -> R {
        work(&mut self.endpoint)
    }

    fn count(&mut self, what: Counted) {
        self.counted.push(what);
    }
}

impl Arriving for Desk {
    fn deliver(&mut self, message: Message) -> Result<(), Undelivered> {
        if self.outcome.is_ok() {
            self.delivered.push((message.from(), message.payload()[0]));
        }
        self.outcome
    }

    fn acknowledge(&mut self, label: Label) {
        self.acknowledged.push(label);
    }

    fn wake_sender(&mut self) {
        self.woken += 1;
    }

    fn is_open(&self) -> bool {
        self.is_open
    }
}

const TO: TaskCode = TaskCode::HORMONE;

fn here() -> (Receiver, Desk) {
    let desk = Desk {
        endpoint: Endpoint::new(Dock::Front, 3, 2),
        outcome: Ok(()),
        delivered: Vec::new(),
        acknowledged: Vec::new(),
        woken: 0,
        counted: Vec::new(),
        is_open: false,
    };
    (Receiver::new(Dock::Front, 65_500), desk)
}

fn data(there: &mut Endpoint, payload: &'static [u8]) -> (Frame<'static>, Label) {
    let label = there.sender.start();
    (Frame::Data { label, to: TO, payload }, label)
}

#[test]
fn a_message_is_delivered_once_and_acknowledged_each_time() {
    let (mut receiver, mut desk) = here();
    let (frame, label) = data(&mut Endpoint::new(Dock::Back, 9, 2), &[5]);
    for now in [65_510, 65_520, 4] {
        receiver.receive(now, frame, &mut desk);
    }
    assert_eq!(desk.delivered, [(Address::beyond(Dock::Front, TO), 5)]);
    assert_eq!(desk.acknowledged, [label; 3]);
    assert_eq!(desk.counted.iter().filter(|counted| **counted == Counted::Duplicates).count(), 2);
}

#[test]
fn what_finds_no_room_is_not_acknowledged_and_what_nobody_wants_is() {
    for (undelivered, counted, acknowledged) in [
        (Undelivered::NoRoom, Counted::NoBuffer, 0),
        (Undelivered::Ignored, Counted::Ignored, 1),
        (Undelivered::Refused, Counted::Refused, 1),
    ] {
        let (mut receiver, mut desk) = here();
        let (frame, _) = data(&mut Endpoint::new(Dock::Back, 9, 2), &[5]);
        desk.outcome = Err(undelivered);
        receiver.receive(0, frame, &mut desk);
        assert_eq!(desk.counted, [Counted::FramesReceived, counted]);
        assert_eq!(desk.acknowledged.len(), acknowledged);
        desk.outcome = Ok(());
        receiver.receive(10, frame, &mut desk);
        assert_eq!(desk.delivered.len(), 1 - acknowledged, "the repetition is new if it is not acknowledged");
    }
}

#[test]
fn after_a_silence_a_stranger_speaks() {
    let (frame, _) = data(&mut Endpoint::new(Dock::Back, 9, 2), &[5]);
    for (silence, delivered) in [(SILENCE, 1), (SILENCE + 1, 2)] {
        let (mut receiver, mut desk) = here();
        receiver.receive(65_510, frame, &mut desk);
        receiver.receive(65_510_u16.wrapping_add(silence), frame, &mut desk);
        assert_eq!(desk.delivered.len(), delivered);
    }
}

#[test]
fn ones_own_reflections_break_no_silence() {
    let (mut receiver, mut desk) = here();
    let (frame, _) = data(&mut Endpoint::new(Dock::Back, 9, 2), &[5]);
    receiver.receive(0, frame, &mut desk);
    for now in (0..=SILENCE).step_by(40) {
        let own = Frame::Datagram { signature: desk.endpoint.sign_datagram(), to: TO, payload: &[7] };
        receiver.receive(now, own, &mut desk);
    }
    receiver.receive(SILENCE + 1, frame, &mut desk);
    assert_eq!(desk.delivered.len(), 2, "who speaks may be another module");
}

/// Neither is a neighbour, nor is one of them taken for the other.
#[test]
fn at_an_open_dock_probes_are_passed_over_and_messages_are_not() {
    let (mut receiver, mut desk) = here();
    let (frame, _) = data(&mut Endpoint::new(Dock::Back, 9, 2), &[5]);
    let probe = |signature| Frame::Datagram { signature, to: TO, payload: &[6] };
    let mut nearby = Endpoint::new(Dock::Left, 7, 2);
    receiver.receive(0, frame, &mut desk);
    desk.is_open = true;
    for now in (0..=SILENCE).step_by(40) {
        receiver.receive(now, probe(nearby.sign_datagram()), &mut desk);
        assert_eq!(desk.counted.last(), Some(&Counted::Ignored));
    }
    receiver.receive(SILENCE + 1, frame, &mut desk);
    assert_eq!(desk.delivered.len(), 2, "who speaks may be another module");
    desk.is_open = false;
    receiver.receive(SILENCE + 2, probe(nearby.sign_datagram()), &mut desk);
    assert_eq!(desk.delivered.len(), 3);
}

#[test]
fn a_datagram_is_delivered_and_not_acknowledged_and_an_ack_wakes_the_sender() {
    let (mut receiver, mut desk) = here();
    let signature = Endpoint::new(Dock::Back, 9, 2).sign_datagram();
    receiver.receive(0, Frame::Datagram { signature, to: TO, payload: &[6] }, &mut desk);
    assert_eq!((desk.delivered.len(), desk.acknowledged.len()), (1, 0));
    let label = desk.endpoint.sender.start();
    receiver.receive(0, Frame::Ack(label), &mut desk);
    receiver.receive(0, Frame::Ack(label), &mut desk);
    assert_eq!(desk.woken, 1);
    let own = desk.endpoint.sign_datagram();
    receiver.receive(0, Frame::Datagram { signature: own, to: TO, payload: &[7] }, &mut desk);
    assert_eq!(desk.delivered.len(), 1);
    assert_eq!(desk.counted.last(), Some(&Counted::Reflections));
}
