extern crate std;

use std::vec::Vec;

use super::Incoming::{Filling, Free, Whole};
use super::Outgoing::{Ended, Idle, Sending, Waiting};
use super::*;
use Transfer::{Done, Fault, Refused};

const FULL: u8 = CAPACITY as u8;

/// Every state of the outgoing packet.
fn all_outgoing() -> Vec<Outgoing> {
    let mut all = Vec::from([Idle, Ended(Done), Ended(Refused), Ended(Fault)]);
    for length in 1..=FULL + 1 {
        all.push(Waiting { length });
        all.extend((1..=length).map(|next| Sending { next, length }));
    }
    all
}

/// Every state of the incoming packet.
fn all_incoming() -> Vec<Incoming> {
    let mut all = Vec::from([Free]);
    all.extend((0..=FULL).map(|length| Filling { length }));
    all.extend((1..=FULL).map(|length| Whole { length }));
    all
}

/// Calls `check` with the engine before and after each status in each state, and with the answer.
fn exhaust(check: impl Fn(u8, Engine, Engine, Answer)) {
    for outgoing in all_outgoing() {
        for incoming in all_incoming() {
            for status in 0..=u8::MAX {
                let before = Engine { outgoing, incoming };
                let mut after = before;
                let answer = after.answer(status);
                check(status, before, after, answer);
            }
        }
    }
}

fn is_under_way(outgoing: Outgoing) -> bool {
    matches!(outgoing, Waiting { .. } | Sending { .. })
}

#[test]
fn a_whole_packet_waits_until_it_is_received() {
    exhaust(|_, before, after, answer| {
        if let Whole { .. } = before.incoming {
            assert_eq!(after.incoming, before.incoming);
            assert!(!matches!(answer.data, Data::Store(_)));
        }
    });
}

#[test]
fn what_has_ended_keeps_its_outcome_when_the_bus_is_freed_and_nothing_else_does() {
    for outgoing in all_outgoing() {
        let mut engine = Engine { outgoing, incoming: Free };
        engine.reset();
        let outcome = engine.outcome();
        assert_eq!(outcome.map(Ended), Some(outgoing).filter(|_| outcome.is_some()));
        assert_eq!(outcome.is_none(), outgoing == Idle || is_under_way(outgoing));
        assert!(engine.is_idle());
    }
}

#[test]
fn what_the_task_has_not_asked_for_is_never_sent() {
    exhaust(|_, before, after, answer| {
        if !is_under_way(before.outgoing) {
            assert_eq!(after.outgoing, before.outgoing);
            assert!(!after.wants_start());
            assert!(!matches!(answer.data, Data::Send(_)));
        }
    });
}

#[test]
fn a_packet_has_the_bus_from_its_start_to_its_stop_or_a_lost_arbitration() {
    use status::*;
    let losses = [ARBITRATION_LOST, LOST_AND_ADDRESSED, LOST_AND_CALLED, LOST_AND_READ];
    exhaust(|status, before, after, answer| {
        let starts = before.wants_start() && [START, REPEATED_START].contains(&status);
        let lets_go = answer.stops || losses.contains(&status);
        assert_eq!(after.is_sending(), starts || before.is_sending() && !lets_go, "{status:#x} {before:?}");
    });
}

#[test]
fn indices_lie_within_the_packets() {
    exhaust(|_, before, after, answer| match answer.data {
        Data::Send(index) => {
            let (next, length) = match before.outgoing {
                Waiting { length } => (0, length),
                Sending { next, length } => (next, length),
                other => panic!("{other:?}"),
            };
            assert_eq!(index, next);
            assert_eq!(after.outgoing, Sending { next: next + 1, length });
            assert!(index < length);
        }
        Data::Store(index) => {
            assert!(before.incoming == Filling { length: index } || before.incoming == Free && index == 0);
            assert_eq!(after.incoming, Filling { length: index + 1 });
            assert!(index < FULL);
        }
        Data::None | Data::Ones => {}
    });
}

#[test]
fn a_transfer_keeps_its_length_until_it_ends() {
    exhaust(|_, before, after, _| match (before.outgoing, after.outgoing) {
        (
            Waiting { length } | Sending { length, .. },
            Waiting { length: now } | Sending { length: now, .. },
        ) => assert_eq!(now, length),
        (Waiting { .. } | Sending { .. }, outgoing) => assert!(matches!(outgoing, Ended(_))),
        _ => {}
    });
}

#[test]
fn the_task_is_signalled_when_a_packet_ends_or_is_whole_and_not_otherwise() {
    exhaust(|_, before, after, answer| {
        let has_ended = is_under_way(before.outgoing) && !is_under_way(after.outgoing);
        let has_come = after.incoming != before.incoming && matches!(after.incoming, Whole { .. });
        assert_eq!(answer.signals, has_ended || has_come);
    });
}

#[test]
fn a_stop_ends_what_has_the_bus_and_never_goes_with_a_start() {
    exhaust(|status, before, after, answer| {
        if answer.stops {
            assert!(!is_under_way(after.outgoing), "{status:#x} {before:?}");
            assert_eq!(answer.data, Data::None);
        }
        if let (Sending { .. }, Ended(_)) = (before.outgoing, after.outgoing) {
            assert!(answer.stops);
        }
    });
}

#[test]
fn the_address_is_acknowledged_only_while_the_buffer_is_free() {
    exhaust(|_, _, after, _| {
        let expected = match after.incoming {
            Free => true,
            Filling { length } => length < FULL,
            Whole { .. } => false,
        };
        assert_eq!(after.acknowledges(), expected);
    });
}

/// The effect of each status of the datasheet on a packet that it concerns; it has none on the other one.
#[test]
fn every_status_of_the_datasheet() {
    use status::*;
    let go_on = Answer { data: Data::None, stops: false, signals: false };
    let ones = Answer { data: Data::Ones, ..go_on };
    let ends = Answer { data: Data::None, stops: true, signals: true };
    let signals = Answer { signals: true, ..go_on };
    let waiting = Waiting { length: 3 };
    let sending = |next| Sending { next, length: 3 };

    let as_master = [
        (START, waiting, sending(1), Answer { data: Data::Send(0), ..go_on }),
        (REPEATED_START, waiting, sending(1), Answer { data: Data::Send(0), ..go_on }),
        (ADDRESS_ACKNOWLEDGED, sending(1), sending(2), Answer { data: Data::Send(1), ..go_on }),
        (ADDRESS_ACKNOWLEDGED, Sending { next: 1, length: 1 }, Ended(Done), ends),
        (ADDRESS_REFUSED, sending(1), Ended(Refused), ends),
        (DATA_ACKNOWLEDGED, sending(2), sending(3), Answer { data: Data::Send(2), ..go_on }),
        (DATA_ACKNOWLEDGED, sending(3), Ended(Done), ends),
        (DATA_REFUSED, sending(2), Ended(Refused), ends),
        (DATA_REFUSED, sending(3), Ended(Refused), ends),
        (ARBITRATION_LOST, sending(1), waiting, go_on),
        (ARBITRATION_LOST, sending(2), waiting, go_on),
        (LOST_AND_CALLED, sending(1), waiting, go_on),
        (LOST_AND_READ, sending(1), waiting, ones),
    ];
    for (status, before, after, expected) in as_master {
        for incoming in all_incoming() {
            let mut engine = Engine { outgoing: before, incoming };
            assert_eq!(engine.answer(status), expected, "{status:#x} {before:?}");
            assert_eq!(engine, Engine { outgoing: after, incoming }, "{status:#x} {before:?}");
        }
    }

    let filling = |length| Filling { length };
    let as_slave = [
        (ADDRESSED, Free, filling(0), go_on),
        (ADDRESSED, filling(5), filling(0), go_on),
        (RECEIVED, filling(0), filling(1), Answer { data: Data::Store(0), ..go_on }),
        (RECEIVED, Free, filling(1), Answer { data: Data::Store(0), ..go_on }),
        (RECEIVED, filling(23), filling(24), Answer { data: Data::Store(23), ..go_on }),
        (RECEIVED_REFUSED, filling(24), Free, go_on),
        (STOP, filling(24), Whole { length: 24 }, signals),
        (STOP, filling(1), Whole { length: 1 }, signals),
        (STOP, filling(0), Free, go_on),
        (STOP, Free, Free, go_on),
        (CALLED, Free, Free, go_on),
        (CALL_RECEIVED, Free, Free, go_on),
        (CALL_RECEIVED_REFUSED, Free, Free, go_on),
        (READ, Free, Free, ones),
        (READ_ACKNOWLEDGED, Free, Free, ones),
        (READ_REFUSED, Free, Free, go_on),
        (READ_LAST, Free, Free, go_on),
    ];
    for (status, before, after, expected) in as_slave {
        for outgoing in [Idle, waiting, Ended(Done), Ended(Refused), Ended(Fault)] {
            let mut engine = Engine { outgoing, incoming: before };
            assert_eq!(engine.answer(status), expected, "{status:#x} {before:?}");
            assert_eq!(engine, Engine { outgoing, incoming: after }, "{status:#x} {before:?}");
        }
    }
}

#[test]
fn the_loser_of_an_arbitration_receives_from_the_winner_and_then_starts_again() {
    let mut engine = Engine { outgoing: Sending { next: 1, length: 2 }, incoming: Free };
    engine.answer(status::LOST_AND_ADDRESSED);
    for _ in 0..3 {
        assert!(engine.wants_start() && engine.acknowledges());
        engine.answer(status::RECEIVED);
    }
    assert!(engine.answer(status::STOP).signals);
    assert_eq!(engine.received(), Some(3));
    assert!(engine.wants_start() && !engine.acknowledges());
    assert_eq!(engine.answer(status::START).data, Data::Send(0));
}

/// A fault is a bus error, a status out of place, or one of the master receiver.
#[test]
fn a_fault_gives_up_both_packets_and_lets_go_of_the_bus() {
    let master_receiver = [
        status::READ_ADDRESS_ACKNOWLEDGED,
        status::READ_ADDRESS_REFUSED,
        status::DATA_READ,
        status::LAST_DATA_READ,
    ];
    for status in master_receiver.into_iter().chain([status::BUS_ERROR]) {
        for outgoing in all_outgoing() {
            for incoming in all_incoming() {
                let mut engine = Engine { outgoing, incoming };
                let answer = engine.answer(status);
                assert!(answer.stops);
                let expected = if is_under_way(outgoing) { Ended(Fault) } else { outgoing };
                assert_eq!(engine.outgoing, expected);
                assert!(!matches!(engine.incoming, Filling { .. }));
            }
        }
    }
    for status in [status::START, status::ADDRESS_ACKNOWLEDGED, status::ADDRESS_REFUSED, status::DATA_REFUSED]
    {
        let mut engine = Engine::new();
        assert!(engine.answer(status).stops, "{status:#x} with nothing to send");
    }
}

/// The sequence of a transfer of three bytes, both sides.
#[test]
fn three_bytes_cross() {
    let (mut master, mut slave) = (Engine::new(), Engine::new());
    let packet = [0x22, 7, 8, 9];
    let mut buffer = [0; CAPACITY];
    master.send(4);
    assert!(master.wants_start());
    assert_eq!(master.answer(status::START).data, Data::Send(0));
    assert!(slave.acknowledges());
    slave.answer(status::ADDRESSED);
    let mut status = status::ADDRESS_ACKNOWLEDGED;
    while let Data::Send(from) = master.answer(status).data {
        let Data::Store(to) = slave.answer(status::RECEIVED).data else { panic!("not stored") };
        buffer[usize::from(to)] = packet[usize::from(from)];
        status = status::DATA_ACKNOWLEDGED;
    }
    slave.answer(status::STOP);
    assert_eq!(master.outcome(), Some(Done));
    assert_eq!(master.outcome(), None);
    assert_eq!(slave.received(), Some(3));
    assert_eq!(buffer[..3], packet[1..]);
    assert!(!slave.acknowledges());
    slave.release();
    assert!(slave.acknowledges() && slave.received().is_none());
}

#[test]
fn a_packet_that_is_sent_while_one_is_under_way_is_ignored() {
    for outgoing in all_outgoing() {
        let mut engine = Engine { outgoing, incoming: Free };
        engine.send(9);
        let expected = if outgoing == Idle { Waiting { length: 9 } } else { outgoing };
        assert_eq!(engine.outgoing, expected);
    }
}

#[test]
fn bytes_that_went_by_without_an_answer_count_as_if_they_had_one() {
    for length in 1..=FULL {
        let mut engine = Engine { outgoing: Waiting { length }, incoming: Free };
        assert_eq!(engine.sendable(), (0, length));
        engine.answer(status::START);
        for sent in 1..=length {
            assert_eq!(engine.sendable(), (sent, length - sent));
            let mut quick = Engine { outgoing: Waiting { length }, incoming: Free };
            quick.catch_up(sent, 0);
            assert_eq!(quick, engine, "after {sent} bytes");
            engine.answer(status::DATA_ACKNOWLEDGED);
        }
        assert_eq!(engine.outgoing, Ended(Done));
    }
    // The address is sent, or the other MCU comes first.
    let mut quick = Engine { outgoing: Waiting { length: 5 }, incoming: Free };
    quick.catch_up(1, 0);
    assert_eq!(quick.outgoing, Sending { next: 1, length: 5 });
    let mut quick = Engine { outgoing: Sending { next: 1, length: 5 }, incoming: Free };
    quick.catch_up(0, 3);
    assert_eq!(quick, Engine { outgoing: Waiting { length: 5 }, incoming: Filling { length: 3 } });
    let mut engine = Engine::new();
    assert_eq!(engine.storable(), (0, STORABLE));
    engine.answer(status::ADDRESSED);
    for stored in 1..=STORABLE {
        assert!(engine.acknowledges());
        engine.answer(status::RECEIVED);
        assert_eq!(engine.storable(), (stored, STORABLE - stored));
        let mut quick = Engine::new();
        quick.catch_up(0, stored);
        assert_eq!(quick, engine, "after {stored} bytes");
    }
    engine.answer(status::RECEIVED);
    assert!(!engine.acknowledges(), "the last one that fits is answered by the engine");
}

#[test]
fn what_has_ended_or_is_whole_does_not_catch_up() {
    exhaust(|_, before, _, _| {
        let mut after = before;
        after.catch_up(3, 5);
        assert_eq!(after.is_sending(), is_under_way(before.outgoing));
        if !is_under_way(before.outgoing) {
            assert_eq!(after.outgoing, before.outgoing);
        }
        let expected = match before.incoming {
            Free | Filling { .. } => Filling { length: 5 },
            whole => whole,
        };
        assert_eq!(after.incoming, expected);
    });
}
