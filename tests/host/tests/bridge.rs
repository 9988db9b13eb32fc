//! The bridge's tasks of both MCUs on one bus that refuses, hangs and spoils transfers: each message crosses
//! once, in order, and the faults are counted.

use std::sync::atomic::{AtomicU16, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard};

use kernel::{Priority, Stack, Task, Ticks, host, now};
use tasks::bridge::protocol::{self, BridgeCounters, MAX_PACKET};
use tasks::bridge::sender::{PAUSE, RETRY_LIMIT, TRANSFER_AT_MOST};
use tasks::bridge::task::{self as bridge, Bridge, Crossing};
use tasks::device::{Bus, Transfer};
use tasks::dock::{Dock, DockSet};
use tasks::mailbox::Mailbox;
use tasks::message::{Address, Message, TaskCode};
use tasks::post_office::PostOffice;
use tasks::router::{Mcu, Residence, Residents, Router, Source, TaskSet};

/// The addressed tasks, one on the master and one on the slave.
const TASKS: [TaskCode; 2] = [TaskCode::HORMONE, TaskCode::AC_RECEIVE];

/// The outcome of a transfer.
#[derive(Clone, Copy, PartialEq)]
enum Fate {
    Arrives,
    Refused,
    Fault,
    /// The transfer does not end until the bus is freed.
    Hangs,
    /// The transfer arrives, but does not end before the bridge is about to free the bus.
    Late,
    Spoilt,
}

/// The bus between both MCUs.
struct Wires {
    /// The packet that has come to each MCU and was not taken yet.
    come: [Option<Vec<u8>>; 2],
    outcomes: [Option<Transfer>; 2],
    /// Whether each MCU's transfer ends as the bus is about to be freed.
    late: [bool; 2],
    sent: [Vec<u8>; 2],
    mailboxes: [&'static Mailbox; 2],
    /// The outcome of each MCU's transfers, by their number.
    fates: [fn(usize) -> Fate; 2],
    /// When each transfer began.
    began: [Vec<Ticks>; 2],
}

impl Wires {
    /// Nothing has come yet.
    fn new(mailboxes: [&'static Mailbox; 2], fates: [fn(usize) -> Fate; 2]) -> Self {
        Wires {
            come: [None, None],
            outcomes: [None; 2],
            late: [false; 2],
            sent: Default::default(),
            mailboxes,
            fates,
            began: Default::default(),
        }
    }
}

/// One MCU's end of the bus.
#[derive(Clone)]
struct End(Arc<Mutex<Wires>>, usize);

impl End {
    fn wires(&self) -> MutexGuard<'_, Wires> {
        self.0.lock().expect("no test panicked with it")
    }

    fn transfer(&mut self, task: &mut Task) {
        let (here, there, time) = (self.1, 1 - self.1, now(task));
        let mut wires = self.wires();
        let number = wires.began[here].len();
        wires.began[here].push(time);
        let mut fate = (wires.fates[here])(number);
        if wires.come[there].is_some() && fate == Fate::Arrives {
            fate = Fate::Refused;
        }
        let mut bytes = wires.sent[here].clone();
        wires.outcomes[here] = match fate {
            Fate::Hangs => None,
            Fate::Late => {
                wires.come[there] = Some(bytes);
                wires.late[here] = true;
                None
            }
            Fate::Refused => Some(Transfer::Refused),
            Fate::Fault => Some(Transfer::Fault),
            Fate::Arrives | Fate::Spoilt => {
                if fate == Fate::Spoilt {
                    bytes[1] ^= 1;
                }
                wires.come[there] = Some(bytes);
                Some(Transfer::Done)
            }
        };
        let mailboxes = wires.mailboxes;
        drop(wires);
        for mailbox in mailboxes {
            mailbox.wake(task);
        }
    }
}

impl Bus for End {
    fn send(&mut self, task: &mut Task, bytes: &[u8]) {
        let here = self.1;
        assert!(self.wires().outcomes[here].is_none(), "one transfer at a time");
        self.wires().sent[here] = bytes.to_vec();
        self.transfer(task);
    }

    fn send_again(&mut self, task: &mut Task) {
        self.transfer(task);
    }

    fn free(&mut self, _task: &mut Task) {
        let mut wires = self.wires();
        if std::mem::take(&mut wires.late[self.1]) {
            wires.outcomes[self.1] = Some(Transfer::Done);
        }
    }

    fn outcome(&mut self, _task: &mut Task) -> Option<Transfer> {
        let here = self.1;
        self.wires().outcomes[here].take()
    }

    fn receive(&mut self, _task: &mut Task, buffer: &mut [u8]) -> Option<usize> {
        let here = self.1;
        let bytes = self.wires().come[here].take()?;
        for (place, byte) in buffer.iter_mut().zip(&bytes) {
            *place = *byte;
        }
        Some(bytes.len())
    }
}

/// How soon an MCU's task hears the messages that have come for it.
#[derive(Clone, Copy, PartialEq)]
enum Hearing {
    Soon,
    /// Three are sent at once, and there is room for one.
    Slow,
    Never,
}

/// The result of a run, by MCU: the messages heard, the counts of the bridge, and when the transfers began.
struct Outcome {
    heard: [Vec<u8>; 2],
    counters: [BridgeCounters; 2],
    began: [Vec<Ticks>; 2],
}

fn forever<T>(value: T) -> &'static T {
    Box::leak(Box::new(value))
}

const fn residents(task: TaskCode) -> Residents {
    Residents { docks: DockSet::EMPTY, tasks: TaskSet::of(&[task]) }
}

/// Each MCU sends so many messages to the other's task, one in 15 ticks. The master's bridge runs as the
/// bridge's task, the slave's is driven turn by turn.
fn run(messages: u8, fates: [fn(usize) -> Fate; 2], hearing: Hearing) -> Outcome {
    let bridges = [0; 2].map(|_| forever(Bridge::new()));
    let mailboxes = [0; 2].map(|_| forever(Mailbox::new(if hearing == Hearing::Soon { 8 } else { 1 })));
    let nobody = forever(Mailbox::new(0));
    let residence = Residence { master: residents(TASKS[0]), slave: residents(TASKS[1]) };
    let office = |here: usize| {
        forever(PostOffice {
            router: Router::new(Mcu::ALL[here], residence),
            tasks: forever([(TASKS[here], mailboxes[here])]),
            devices: nobody,
            links: &[],
            bridge: bridges[here].mailbox(),
        })
    };
    let offices = [office(0), office(1)];
    let wires = Arc::new(Mutex::new(Wires::new(bridges.map(Bridge::mailbox), fates)));
    let ends = [0, 1].map(|here| End(Arc::clone(&wires), here));
    let outcome = Arc::new(Mutex::new([None, None]));
    let written = Arc::clone(&outcome);
    host::run_for(
        6_000,
        move |boot| {
            for (here, end) in ends.into_iter().enumerate() {
                let stacks: [&'static Stack<8000>; 2] = [0; 2].map(|_| forever(Stack::new()));
                let (bridge, office) = (bridges[here], offices[here]);
                let cross = move |task: &mut Task| {
                    if here == 0 {
                        bridge::run(task, bridge, end, office);
                    }
                    let (mut crossing, mut end) = (Crossing::new(), end);
                    loop {
                        match crossing.turn(task, bridge, &mut end, office) {
                            Some(left) => bridge.mailbox().wake_in(task, left),
                            None => bridge.mailbox().cancel_alarm(task),
                        }
                        bridge.mailbox().wait(task);
                    }
                };
                stacks[0].start(boot, Priority::P1, cross).expect("the stack is free");
                let (heard_at, written) = (mailboxes[here], Arc::clone(&written));
                let speak = move |task: &mut Task| {
                    let mut heard = Vec::new();
                    let mut hear = |task: &mut Task, ticks| {
                        task.delay(ticks);
                        while hearing != Hearing::Never
                            && let Some(letter) = heard_at.take(task)
                        {
                            heard.extend(letter.payload());
                        }
                    };
                    for number in 0..messages {
                        let (to, from) = (Address::here(TASKS[1 - here]), Address::here(TASKS[here]));
                        let payload = [number];
                        let message = Message::new(to, from, &payload).expect("it is short");
                        assert_eq!(office.deliver(task, message, Source::Task), Ok(()));
                        let at_once = if hearing == Hearing::Slow { 3 } else { 1 };
                        if number % at_once == at_once - 1 {
                            (0..at_once).for_each(|_| hear(task, 15 / Ticks::from(at_once)));
                        }
                    }
                    hear(task, 500);
                    written.lock().expect("no test panicked with it")[here] =
                        Some((heard, bridge.counters(task)));
                    loop {
                        task.delay(1_000);
                    }
                };
                stacks[1].start(boot, Priority::P4, speak).expect("the stack is free");
            }
        },
        |_, _| {},
    );
    let outcome = std::mem::take(&mut *outcome.lock().expect("no test panicked with it"));
    let [(here, counted_here), (there, counted_there)] = outcome.map(|end| end.expect("it came to its end"));
    let began = std::mem::take(&mut wires.lock().expect("no test panicked with it").began);
    Outcome { heard: [here, there], counters: [counted_here, counted_there], began }
}

const MESSAGES: u8 = 20;

fn all() -> Vec<u8> {
    (0..MESSAGES).collect()
}

#[test]
fn messages_cross_both_ways_and_in_order() {
    let outcome = run(MESSAGES, [|_| Fate::Arrives; 2], Hearing::Soon);
    assert_eq!(outcome.heard, [all(), all()]);
    for counters in outcome.counters {
        let (messages_sent, messages_received) = (MESSAGES.into(), MESSAGES.into());
        let retries = counters.retries;
        assert_eq!(
            counters,
            BridgeCounters { messages_sent, messages_received, retries, ..Default::default() }
        );
    }
}

#[test]
fn a_packet_that_arrives_as_the_bus_is_freed_crosses_once() {
    let outcome = run(MESSAGES, [|_| Fate::Late, |_| Fate::Arrives], Hearing::Soon);
    assert_eq!(outcome.heard, [all(), all()]);
    let messages = u16::from(MESSAGES);
    let counters = outcome.counters[0];
    assert_eq!((counters.messages_sent, counters.freed, counters.retries), (messages, messages, 0));
}

#[test]
fn what_fails_is_sent_again_after_a_pause_and_a_bus_that_hangs_is_freed() {
    let fates = |number| match number % 4 {
        0 => Fate::Refused,
        1 => Fate::Fault,
        2 => Fate::Hangs,
        _ => Fate::Arrives,
    };
    let messages = u16::from(MESSAGES);
    // One direction at a time, so that nothing else wakes a bridge.
    for way in 0..2 {
        let mut both: [fn(usize) -> Fate; 2] = [|_| Fate::Arrives; 2];
        both[way] = fates;
        let outcome = run(MESSAGES, both, Hearing::Soon);
        assert_eq!(outcome.heard, [all(), all()]);
        let counters = outcome.counters[way];
        assert_eq!((counters.messages_sent, counters.freed, counters.gave_up), (messages, messages, 0));
        assert_eq!(counters.retries, 3 * messages);
        for (number, pair) in outcome.began[way].windows(2).enumerate() {
            let pause = pair[1] - pair[0];
            match fates(number) {
                Fate::Refused | Fate::Fault => assert!((PAUSE..=PAUSE + 1).contains(&pause), "{pause}"),
                Fate::Hangs => {
                    let longest = TRANSFER_AT_MOST + PAUSE;
                    assert!((longest..=longest + 1).contains(&pause), "{pause}");
                }
                Fate::Arrives | Fate::Late | Fate::Spoilt => {}
            }
        }
    }
}

#[test]
fn a_packet_that_the_other_mcu_never_takes_is_given_up() {
    let outcome = run(3, [|_| Fate::Refused, |_| Fate::Arrives], Hearing::Soon);
    assert_eq!(outcome.heard, [vec![0, 1, 2], vec![]]);
    let counters = outcome.counters[0];
    assert_eq!((counters.gave_up, counters.messages_sent), (3, 0));
    assert_eq!(counters.retries, 3 * u16::from(RETRY_LIMIT));
}

/// A joint's order is said once, and so is that the joint has stalled.
#[test]
fn what_finds_no_room_waits_for_it() {
    let messages = MESSAGES / 3 * 3;
    let outcome = run(messages, [|_| Fate::Arrives; 2], Hearing::Slow);
    for (heard, counters) in outcome.heard.into_iter().zip(outcome.counters) {
        assert_eq!(heard, Vec::from_iter(0..messages));
        assert_eq!((counters.no_buffer, counters.gave_up), (0, 0));
    }
}

/// The turns in which the master's bridge tries to deliver a message for which there will never be room.
fn tries(to: Address) -> u16 {
    let (bridge, nobody) = (forever(Bridge::new()), forever(Mailbox::new(0)));
    let residents = Residents { docks: DockSet::of(&[Dock::Front]), ..residents(TASKS[0]) };
    let office = forever(PostOffice {
        router: Router::new(Mcu::Master, Residence { master: residents, slave: self::residents(TASKS[1]) }),
        tasks: forever([(TASKS[0], nobody)]),
        devices: nobody,
        links: forever([(Dock::Front, nobody)]),
        bridge: bridge.mailbox(),
    });
    let message = Message::new(to, Address::here(TASKS[1]), &[]).expect("it is short");
    let packet = protocol::encode(message, &mut [0; MAX_PACKET]).to_vec();
    let wires = Wires { come: [Some(packet), None], ..Wires::new([nobody; 2], [|_| Fate::Arrives; 2]) };
    let mut end = End(Arc::new(Mutex::new(wires)), 0);
    let tries: &AtomicU16 = forever(AtomicU16::new(1));
    let stack: &'static Stack<8000> = forever(Stack::new());
    host::run_for(
        100,
        move |boot| {
            let cross = move |task: &mut Task| {
                let mut crossing = Crossing::new();
                loop {
                    crossing.turn(task, bridge, &mut end, office);
                    let is_lost = bridge.counters(task).no_buffer > 0;
                    tries.fetch_add(u16::from(!is_lost), Relaxed);
                    task.delay(1);
                }
            };
            stack.start(boot, Priority::P1, cross).expect("the stack is free");
        },
        |_, _| {},
    );
    tries.load(Relaxed)
}

#[test]
fn what_is_for_a_task_waits_and_what_is_for_a_dock_does_not() {
    assert_eq!(tries(Address::here(TASKS[0])), RETRY_LIMIT.into());
    assert_eq!(tries(Address::beyond(Dock::Front, TASKS[0])), 1);
}

#[test]
fn what_came_in_spoilt_or_finds_no_room_is_counted_and_dropped() {
    let outcome = run(5, [|_| Fate::Spoilt, |_| Fate::Arrives], Hearing::Soon);
    assert_eq!(outcome.heard, [(0..5).collect(), vec![]]);
    assert_eq!((outcome.counters[1].errors, outcome.counters[1].messages_received), (5, 0));
    let outcome = run(5, [|_| Fate::Arrives; 2], Hearing::Never);
    for counters in outcome.counters {
        assert_eq!((counters.no_buffer, counters.messages_received), (4, 1));
    }
}
