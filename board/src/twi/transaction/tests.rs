extern crate std;

use std::vec;
use std::vec::Vec;

use super::State::{Ended, Running, Waiting};
use super::*;

const ADDRESS: u8 = 0x48;
const SLA_W: u8 = 0x90;
const SLA_R: u8 = 0x91;

const STATES: [State; 6] = [
    Waiting,
    Running,
    Ended(Ok(())),
    Ended(Err(Bus)),
    Ended(Err(NoAcknowledge(Address))),
    Ended(Err(NoAcknowledge(Data))),
];

const LOSSES: [u8; 4] =
    [status::ARBITRATION_LOST, status::LOST_AND_ADDRESSED, status::LOST_AND_CALLED, status::LOST_AND_READ];

/// An operation by its direction and length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Write(usize),
    Read(usize),
}
use Kind::{Read, Write};

impl Kind {
    fn reads(self) -> bool {
        matches!(self, Read(_))
    }

    fn len(self) -> usize {
        match self {
            Write(length) | Read(length) => length,
        }
    }
}

/// Every list of up to `most` operations of 0 to 2 bytes each.
fn lists(most: usize) -> Vec<Vec<Kind>> {
    let kinds = [Write(0), Write(1), Write(2), Read(0), Read(1), Read(2)];
    let mut all = vec![vec![]];
    let mut longest = all.clone();
    for _ in 0..most {
        longest = longest.iter().flat_map(|list| kinds.map(|kind| [&list[..], &[kind]].concat())).collect();
        all.extend(longest.iter().cloned());
    }
    all
}

/// A buffer for each operation; those that are written count up from 1 through all of them.
fn buffers(kinds: &[Kind]) -> Vec<Vec<u8>> {
    let mut values = 1..;
    kinds
        .iter()
        .map(|kind| (0..kind.len()).map(|_| if kind.reads() { 0 } else { values.next().unwrap() }).collect())
        .collect()
}

fn operations<'a>(kinds: &[Kind], buffers: &'a mut [Vec<u8>]) -> Vec<Operation<'a>> {
    kinds
        .iter()
        .zip(buffers)
        .map(|(kind, buffer)| if kind.reads() { Operation::Read(buffer) } else { Operation::Write(buffer) })
        .collect()
}

/// Every state of a transaction with `operations` operations of up to two bytes.
fn all_transactions(operations: usize) -> Vec<Transaction> {
    let mut all = vec![];
    for state in STATES {
        for operation in 0..=operations {
            for next in 0..=2 {
                for unread in 0..=2 * operations {
                    all.push(Transaction { state, destination: SLA_W, operation, next, unread });
                }
            }
        }
    }
    all
}

#[test]
fn only_what_is_under_way_is_concerned() {
    for transaction in all_transactions(1) {
        for status in 0..=u8::MAX {
            for packet_waits in [false, true] {
                let expected = match transaction.state {
                    Running => true,
                    Waiting => status == status::BUS_ERROR || status == status::START && !packet_waits,
                    Ended(_) => false,
                };
                assert_eq!(transaction.is_concerned(status, packet_waits), expected, "{status:#x}");
            }
        }
    }
}

/// The properties that hold for each status that concerns a transaction, in each of its states, with each
/// list.
#[test]
fn every_status_in_every_state() {
    const BYTE: u8 = 0xab;
    for kinds in lists(2) {
        for before in all_transactions(kinds.len()) {
            for status in (0..=u8::MAX).filter(|status| before.is_concerned(*status, false)) {
                let untouched = buffers(&kinds);
                let mut lent = untouched.clone();
                let mut after = before;
                let step = after.answer(status, BYTE, &mut operations(&kinds, &mut lent));
                let context = std::format!("{status:#x} {before:?} {kinds:?}: {step:?}");

                assert_eq!(after.destination, SLA_W);
                assert!(after.operation <= kinds.len(), "{context}");
                match step {
                    Some(Step::Stop) => assert!(matches!(after.state, Ended(_)), "{context}"),
                    Some(step) => {
                        assert_eq!(after.state, Running, "{context}");
                        assert!(step != Step::RepeatStart || after.operation < kinds.len(), "{context}");
                    }
                    None if LOSSES.contains(&status) => assert_eq!(after.state, Waiting, "{context}"),
                    None => assert_eq!(after.state, Ended(Err(Bus)), "{context}"),
                }

                let is_read = [status::DATA_READ, status::LAST_DATA_READ].contains(&status);
                let pairs = untouched.iter().flatten().zip(lent.iter().flatten());
                let changed: Vec<&u8> =
                    pairs.filter(|(before, after)| before != after).map(|(_, after)| after).collect();
                assert!(changed.len() <= usize::from(is_read), "{context}");
                assert!(changed.iter().all(|byte| **byte == BYTE), "{context}");
            }
        }
    }
}

/// The effect of each status in the datasheet's tables for masters.
#[test]
fn every_status_of_a_master() {
    use status::*;
    let kinds = [Write(2), Read(2)];
    let waiting = Transaction::new(ADDRESS);
    let writing = |next| Transaction { state: Running, next, ..waiting };
    let reading = |next, unread| Transaction { state: Running, operation: 1, next, unread, ..waiting };
    let ended = |before: Transaction, outcome| Transaction { state: Ended(outcome), ..before };
    let lost = |before: Transaction| Transaction { state: Waiting, ..before };
    let (no_address, no_data) = (Err(NoAcknowledge(Address)), Err(NoAcknowledge(Data)));
    let more = Some(Step::Read { acknowledges: true });
    let last = Some(Step::Read { acknowledges: false });

    let cases = [
        (START, waiting, writing(0), Some(Step::Send(SLA_W))),
        (START, lost(reading(1, 1)), writing(0), Some(Step::Send(SLA_W))),
        (ADDRESS_ACKNOWLEDGED, writing(0), writing(1), Some(Step::Send(1))),
        (DATA_ACKNOWLEDGED, writing(1), writing(2), Some(Step::Send(2))),
        (DATA_ACKNOWLEDGED, writing(2), reading(0, 0), Some(Step::RepeatStart)),
        (REPEATED_START, reading(0, 0), reading(0, 2), Some(Step::Send(SLA_R))),
        (READ_ADDRESS_ACKNOWLEDGED, reading(0, 2), reading(0, 2), more),
        (DATA_READ, reading(0, 2), reading(1, 1), last),
        (
            LAST_DATA_READ,
            reading(1, 1),
            Transaction { operation: 2, ..ended(reading(0, 0), Ok(())) },
            Some(Step::Stop),
        ),
        (ADDRESS_REFUSED, writing(0), ended(writing(0), no_address), Some(Step::Stop)),
        (READ_ADDRESS_REFUSED, reading(0, 2), ended(reading(0, 2), no_address), Some(Step::Stop)),
        (DATA_REFUSED, writing(1), ended(writing(1), no_data), Some(Step::Stop)),
        (DATA_REFUSED, writing(2), ended(writing(2), no_data), Some(Step::Stop)),
        (ARBITRATION_LOST, writing(0), lost(writing(0)), None),
        (ARBITRATION_LOST, writing(2), lost(writing(2)), None),
        (ARBITRATION_LOST, reading(1, 1), lost(reading(1, 1)), None),
        (LOST_AND_ADDRESSED, writing(0), lost(writing(0)), None),
        (LOST_AND_CALLED, writing(0), lost(writing(0)), None),
        (LOST_AND_READ, writing(0), lost(writing(0)), None),
        (BUS_ERROR, waiting, ended(waiting, Err(Bus)), None),
        (BUS_ERROR, writing(1), ended(writing(1), Err(Bus)), None),
    ];
    for (status, before, after, step) in cases {
        let mut transaction = before;
        assert!(before.is_concerned(status, false), "{status:#x} {before:?}");
        let answer = transaction.answer(status, 7, &mut operations(&kinds, &mut buffers(&kinds)));
        assert_eq!((transaction, answer), (after, step), "{status:#x} {before:?}");
    }
}

/// An event on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Seen {
    Start,
    RepeatedStart,
    Address(u8),
    Written(u8),
    Read { byte: u8, acknowledged: bool },
    Stop,
}

/// The bytes that a device sends when it is read.
const READ_FROM: u8 = 0x60;

/// Consecutive operations in the same direction.
fn runs(kinds: &[Kind]) -> impl Iterator<Item = &[Kind]> {
    kinds.chunk_by(|one, next| one.reads() == next.reads())
}

/// How many bytes of a run pass over the bus. The interface can't end a read before the first.
fn length(run: &[Kind]) -> usize {
    let length = run.iter().map(|kind| kind.len()).sum();
    if run[0].reads() { usize::max(length, 1) } else { length }
}

/// The events that embedded-hal's contract requires: "Data from adjacent operations of the same type are sent
/// after each other without an SP or SR. Between adjacent operations of a different type an SR and SAD+R/W is
/// sent."
fn contract(kinds: &[Kind]) -> Vec<Seen> {
    let (mut written, mut read) = (1.., READ_FROM..);
    let mut seen = vec![];
    for run in runs(kinds) {
        seen.push(if seen.is_empty() { Seen::Start } else { Seen::RepeatedStart });
        let length = length(run);
        if run[0].reads() {
            seen.push(Seen::Address(SLA_R));
            for (number, byte) in (1..=length).zip(read.by_ref()) {
                seen.push(Seen::Read { byte, acknowledged: number < length });
            }
        } else {
            seen.push(Seen::Address(SLA_W));
            seen.extend(written.by_ref().take(length).map(Seen::Written));
        }
    }
    seen.push(Seen::Stop);
    seen
}

/// The buffers when all bytes were read.
fn after_reads(kinds: &[Kind]) -> Vec<Vec<u8>> {
    let mut read = READ_FROM..;
    let mut buffers = buffers(kinds);
    let mut rest = buffers.iter_mut();
    for run in runs(kinds) {
        let own = rest.by_ref().take(run.len()).flatten();
        if run[0].reads() {
            let bytes: Vec<u8> = read.by_ref().take(length(run)).collect();
            own.zip(bytes).for_each(|(slot, byte)| *slot = byte);
        } else {
            own.for_each(drop);
        }
    }
    buffers
}

/// The disturbance by the device or other masters at an event in place of an acknowledge, if any.
type Disturbance<'a> = &'a dyn Fn(usize, Seen) -> Option<u8>;

/// Plays a transaction from its START to its end, or to the disturbance. Returns what was seen up to there.
fn play(
    transaction: &mut Transaction,
    operations: &mut [Operation],
    disturbance: Disturbance,
) -> (Vec<Seen>, Option<Step>) {
    let mut read = READ_FROM..;
    let mut seen = vec![Seen::Start];
    let mut step = transaction.answer(status::START, 0, operations);
    loop {
        let is_address = matches!(seen.last(), Some(Seen::Start | Seen::RepeatedStart));
        let (event, status) = match step {
            Some(Step::Send(byte)) if is_address && byte & 1 == 0 => {
                (Seen::Address(byte), status::ADDRESS_ACKNOWLEDGED)
            }
            Some(Step::Send(byte)) if is_address => (Seen::Address(byte), status::READ_ADDRESS_ACKNOWLEDGED),
            Some(Step::Send(byte)) => (Seen::Written(byte), status::DATA_ACKNOWLEDGED),
            Some(Step::Read { acknowledges }) => {
                let event = Seen::Read { byte: read.next().unwrap(), acknowledged: acknowledges };
                (event, if acknowledges { status::DATA_READ } else { status::LAST_DATA_READ })
            }
            Some(Step::RepeatStart) => (Seen::RepeatedStart, status::REPEATED_START),
            Some(Step::Stop) => {
                seen.push(Seen::Stop);
                return (seen, step);
            }
            None => return (seen, step),
        };
        let data = if let Seen::Read { byte, .. } = event { byte } else { 0 };
        let status = disturbance(seen.len(), event).unwrap_or(status);
        seen.push(event);
        assert!(transaction.is_concerned(status, true));
        step = transaction.answer(status, data, operations);
    }
}

const UNDISTURBED: Disturbance = &|_, _| None;

fn lists_to_play() -> impl Iterator<Item = Vec<Kind>> {
    lists(4).into_iter().filter(|kinds| !kinds.is_empty())
}

#[test]
fn transactions_follow_the_contract_of_embedded_hal() {
    for kinds in lists_to_play() {
        let mut lent = buffers(&kinds);
        let mut transaction = Transaction::new(ADDRESS);
        let (seen, _) = play(&mut transaction, &mut operations(&kinds, &mut lent), UNDISTURBED);
        assert_eq!(seen, contract(&kinds), "{kinds:?}");
        assert_eq!(transaction.outcome(), Some(Ok(())));
        assert_eq!(lent, after_reads(&kinds), "{kinds:?}");
    }
}

#[test]
fn a_transaction_that_loses_the_arbitration_begins_again() {
    for kinds in lists_to_play() {
        let whole = contract(&kinds);
        for lost_at in 1..whole.len() - 1 {
            for loss in LOSSES {
                let mut lent = buffers(&kinds);
                let mut operations = operations(&kinds, &mut lent);
                let mut transaction = Transaction::new(ADDRESS);
                let loses = |at, _| (at == lost_at).then_some(loss);
                let (seen, step) = play(&mut transaction, &mut operations, &loses);
                assert_eq!((&seen[..], step), (&whole[..=lost_at], None));
                assert!(transaction.wants_start() && transaction.outcome().is_none());
                let (seen, _) = play(&mut transaction, &mut operations, UNDISTURBED);
                assert_eq!(seen, whole, "{kinds:?} lost at {lost_at}");
                assert_eq!(transaction.outcome(), Some(Ok(())));
                assert_eq!(lent, after_reads(&kinds), "{kinds:?} lost at {lost_at}");
            }
        }
    }
}

#[test]
fn a_refusal_ends_a_transaction_with_a_stop() {
    for kinds in lists_to_play() {
        let whole = contract(&kinds);
        for refused_at in 1..whole.len() - 1 {
            let (refusal, outcome) = match whole[refused_at] {
                Seen::Address(SLA_W) => (status::ADDRESS_REFUSED, NoAcknowledge(Address)),
                Seen::Address(_) => (status::READ_ADDRESS_REFUSED, NoAcknowledge(Address)),
                Seen::Written(_) => (status::DATA_REFUSED, NoAcknowledge(Data)),
                _ => continue,
            };
            let mut transaction = Transaction::new(ADDRESS);
            let mut lent = buffers(&kinds);
            let refuses = |at, _| (at == refused_at).then_some(refusal);
            let (seen, _) = play(&mut transaction, &mut operations(&kinds, &mut lent), &refuses);
            assert_eq!(seen, [&whole[..=refused_at], &[Seen::Stop]].concat(), "{kinds:?}");
            assert_eq!(transaction.outcome(), Some(Err(outcome)), "{kinds:?}");
        }
    }
}

#[test]
fn a_bus_error_ends_a_transaction_wherever_it_strikes() {
    for kinds in lists_to_play() {
        for struck_at in 1..contract(&kinds).len() - 1 {
            let mut transaction = Transaction::new(ADDRESS);
            let mut lent = buffers(&kinds);
            let strikes = |at, _| (at == struck_at).then_some(status::BUS_ERROR);
            let (_, step) = play(&mut transaction, &mut operations(&kinds, &mut lent), &strikes);
            assert_eq!((step, transaction.outcome()), (None, Some(Err(Bus))), "{kinds:?}");
        }
    }
}

#[test]
fn before_there_was_any_none_is_under_way() {
    assert!(!Transaction::NONE.wants_start());
    assert_eq!(Transaction::NONE.outcome(), Some(Ok(())));
}
