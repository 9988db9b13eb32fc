extern crate std;

use super::*;
use crate::twi::control::{ACKNOWLEDGE, ENABLED, GO_ON, INTERRUPT, START, STOP};
use crate::twi::engine::{Answer, CAPACITY};
use std::collections::VecDeque;
use std::vec::Vec;

const STATUSES: [u8; 14] = [
    status::BUS_ERROR,
    status::START,
    status::REPEATED_START,
    status::ADDRESS_ACKNOWLEDGED,
    status::ADDRESS_REFUSED,
    status::DATA_ACKNOWLEDGED,
    status::DATA_REFUSED,
    status::ARBITRATION_LOST,
    status::ADDRESSED,
    status::LOST_AND_ADDRESSED,
    status::RECEIVED,
    status::RECEIVED_REFUSED,
    status::STOP,
    status::READ,
];

/// The engine with the vector's answers before it, as `interface` has them.
struct Interface {
    engine: Engine,
    streams: Streams,
    quick: usize,
}

impl Interface {
    fn new() -> Self {
        let (engine, streams) = (Engine::new(), Streams::new());
        streams.arm(&engine);
        Interface { engine, streams, quick: 0 }
    }

    /// What is done with TWDR, what is written to TWCR, and whether the task is to be woken.
    fn answer(&mut self, status: u8) -> (Data, u8, bool) {
        if let Some(data) = self.streams.answer(status) {
            self.quick += 1;
            self.streams.advance(data);
            return (data, GO_ON, false);
        }
        if let Some(control) = self.streams.turn(status) {
            return (Data::None, control, self.streams.has_ended());
        }
        self.settle();
        self.streams.catch_up(&mut self.engine);
        let answer = self.engine.answer(status);
        self.streams.arm(&self.engine);
        (answer.data, control_of(&self.engine, answer), answer.signals)
    }

    fn settle(&mut self) {
        if let Some(ended) = self.streams.take_ended() {
            self.streams.catch_up(&mut self.engine);
            self.engine.settle(ended.sent, ended.is_received);
        }
    }

    /// The bus was freed.
    fn free(&mut self) {
        self.streams.end_incoming();
        self.settle();
        self.engine.reset();
        self.streams.arm(&self.engine);
    }

    /// The state of the engine when it is asked.
    fn asked(&self) -> Engine {
        let mut engine = self.engine;
        self.streams.catch_up(&mut engine);
        engine
    }
}

fn control_of(engine: &Engine, answer: Answer) -> u8 {
    let bit = |is_set: bool, bit: u8| if is_set { bit } else { 0 };
    ENABLED
        | INTERRUPT
        | bit(engine.wants_start(), START)
        | bit(engine.acknowledges(), ACKNOWLEDGE)
        | bit(answer.stops, STOP)
}

/// Checks the vector with the engine behind it against the engine alone, on one trace.
struct Pair {
    alone: Engine,
    both: Interface,
    trace: VecDeque<u8>,
}

impl Pair {
    fn new() -> Self {
        Pair { alone: Engine::new(), both: Interface::new(), trace: VecDeque::new() }
    }

    fn status(&mut self, status: u8) {
        self.trace.push_back(status);
        let expected = self.alone.answer(status);
        let expected = (expected.data, control_of(&self.alone, expected), expected.signals);
        let (data, control, signals) = self.both.answer(status);
        assert_eq!((data, signals), (expected.0, expected.2), "{:x?}", self.trace);
        // In the middle of a packet the vector requests no START, and acknowledges an address although the
        // engine then refuses each byte.
        let matters = if control == GO_ON { !(START | ACKNOWLEDGE) } else { 0xff };
        assert_eq!(control & matters, expected.1 & matters, "{:x?}", self.trace);
        if status == status::RECEIVED || status == status::ADDRESSED {
            assert_eq!(control & ACKNOWLEDGE, expected.1 & ACKNOWLEDGE, "{:x?}", self.trace);
        }
    }

    /// What the task does: 0 to send, 1 to take an outcome, 2 to take a packet, else nothing.
    fn task(&mut self, what: u32, length: u8) {
        self.both.settle();
        match what {
            0 if self.alone.is_idle() => {
                self.alone.send(length);
                self.both.engine.send(length);
                self.both.streams.arm_outgoing(&self.both.engine);
            }
            1 => assert_eq!(self.both.engine.outcome(), self.alone.outcome(), "{:x?}", self.trace),
            2 if self.alone.received().is_some() => {
                assert_eq!(self.both.engine.received(), self.alone.received(), "{:x?}", self.trace);
                self.alone.release();
                self.both.engine.release();
                self.both.streams.arm_incoming(&self.both.engine);
            }
            _ => {}
        }
        // A packet of which nothing was received counts as none.
        let (asked, alone) = (self.both.asked(), self.alone);
        assert_eq!(
            (
                asked.is_sending(),
                asked.wants_start(),
                asked.acknowledges(),
                asked.received(),
                asked.sendable(),
                asked.storable()
            ),
            (
                alone.is_sending(),
                alone.wants_start(),
                alone.acknowledges(),
                alone.received(),
                alone.sendable(),
                alone.storable()
            ),
            "{:x?}",
            self.trace
        );
    }
}

/// Numbers by a linear congruence.
struct Random(u32);

impl Random {
    fn below(&mut self, limit: u32) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) % limit
    }
}

/// The statuses that may follow `status`, on a bus with arbitrary other devices.
fn follows(status: u8, engine: &Engine) -> Vec<u8> {
    use status::*;
    let own_start = if engine.wants_start() { Some(START) } else { None };
    let idle = || own_start.into_iter().chain(engine.acknowledges().then_some(ADDRESSED)).collect();
    match status {
        START => std::vec![ADDRESS_ACKNOWLEDGED, ADDRESS_REFUSED, ARBITRATION_LOST, LOST_AND_ADDRESSED],
        ADDRESS_ACKNOWLEDGED | DATA_ACKNOWLEDGED if engine.is_sending() => {
            std::vec![
                DATA_ACKNOWLEDGED,
                DATA_ACKNOWLEDGED,
                DATA_ACKNOWLEDGED,
                DATA_REFUSED,
                ARBITRATION_LOST,
                BUS_ERROR
            ]
        }
        ADDRESSED | LOST_AND_ADDRESSED | RECEIVED if engine.acknowledges() => {
            std::vec![RECEIVED, RECEIVED, RECEIVED, STOP, BUS_ERROR]
        }
        ADDRESSED | LOST_AND_ADDRESSED | RECEIVED => std::vec![RECEIVED_REFUSED, STOP],
        _ => idle(),
    }
}

#[test]
fn on_traces_as_the_bus_makes_them_the_vector_answers_as_the_engine() {
    let mut random = Random(1);
    for _ in 0..2_000 {
        let mut pair = Pair::new();
        let mut last = status::STOP;
        for _ in 0..400 {
            let next = follows(last, &pair.alone);
            if let Some(&status) = next.get(random.below(next.len().max(1) as u32) as usize) {
                pair.status(status);
                last = status;
            } else {
                last = status::STOP;
            }
            let what = random.below(6);
            pair.task(what, 1 + random.below(1 + CAPACITY as u32) as u8);
        }
        assert!(pair.both.quick > 50, "the vector answers most: {} of 400", pair.both.quick);
    }
}

#[test]
fn every_packet_goes_by_without_the_engine() {
    for length in 2..=1 + CAPACITY as u8 {
        let mut pair = Pair::new();
        pair.task(0, length);
        pair.status(status::START);
        pair.status(status::ADDRESS_ACKNOWLEDGED);
        for _ in 1..length {
            pair.status(status::DATA_ACKNOWLEDGED);
        }
        assert_eq!(pair.both.quick, usize::from(length), "all but the STOP");
        pair.task(1, 0);
    }
    for length in 1..CAPACITY {
        let mut pair = Pair::new();
        pair.status(status::ADDRESSED);
        for _ in 0..length {
            pair.status(status::RECEIVED);
        }
        pair.status(status::STOP);
        assert_eq!(pair.both.quick, length + 1);
        pair.task(2, 0);
    }
}

#[test]
fn what_has_come_is_a_packet_when_the_bus_is_freed_and_its_outcome_stays() {
    for length in 0..=CAPACITY as u8 {
        for has_ended in [false, true] {
            let mut both = Interface::new();
            both.engine.send(2);
            both.streams.arm_outgoing(&both.engine);
            if has_ended {
                for status in [status::START, status::ADDRESS_ACKNOWLEDGED, status::DATA_ACKNOWLEDGED] {
                    both.answer(status);
                }
            }
            both.answer(status::ADDRESSED);
            for _ in 0..length {
                both.answer(status::RECEIVED);
            }
            both.free();
            assert_eq!(both.engine.received(), Some(length).filter(|length| *length > 0));
            assert_eq!(both.engine.outcome(), has_ended.then_some(Transfer::Done));
            assert!(both.engine.is_idle());
        }
    }
}

#[test]
fn with_nothing_to_send_or_to_store_all_is_left_to_the_engine() {
    let streams = Streams::new();
    assert!((0..=u8::MAX).all(|twsr| streams.answer(twsr).is_none()));
}

#[test]
fn traces_of_any_statuses_go_by_without_a_byte_out_of_its_packet() {
    let mut random = Random(2);
    for _ in 0..20_000 {
        let mut both = Interface::new();
        both.engine.send(1 + random.below(1 + CAPACITY as u32) as u8);
        both.streams.arm(&both.engine);
        for _ in 0..60 {
            let status = STATUSES[random.below(STATUSES.len() as u32) as usize];
            match both.answer(status).0 {
                Data::Send(index) => assert!(usize::from(index) <= CAPACITY),
                Data::Store(index) => assert!(usize::from(index) < CAPACITY),
                Data::None | Data::Ones => {}
            }
        }
    }
}
