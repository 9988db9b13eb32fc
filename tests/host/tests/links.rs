//! Both tasks of a dock, at both ends of a line that loses frames: each message arrives once, in order, and
//! the faults are counted.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard};

use kernel::{Priority, Semaphore, Stack, Task, Ticks, host, now};
use tasks::device::{NoLatches, Receive, Transmit};
use tasks::dock::Dock;
use tasks::link::counters::LinkCounters;
use tasks::link::frame::Frame;
use tasks::link::port::{Port, RETRY_LIMIT};
use tasks::link::receive::{self, Incoming};
use tasks::link::send;
use tasks::link::signature::Signature;
use tasks::mailbox::Mailbox;
use tasks::message::{Address, Message, TaskCode};
use tasks::post_office::PostOffice;
use tasks::router::{Mcu, Router, Source};
use tasks::superbot::RESIDENCE;

const HORMONE: TaskCode = TaskCode::HORMONE;

/// Messages that each end sends.
const MESSAGES: u8 = 30;

/// A line between two ends, one of which may send at a time.
struct Line {
    /// The bytes that have arrived for each end and wait there.
    toward: [VecDeque<u8>; 2],
    /// Whether a frame comes in at each end.
    comes_in: [bool; 2],
    signals: [Option<&'static Semaphore>; 2],
    /// The fate of each frame, by its number.
    fate: fn(usize) -> Fate,
    frames: usize,
    signatures: Vec<Signature>,
    /// When each message had been sent.
    messages: Vec<Ticks>,
}

#[derive(Clone, Copy)]
enum Fate {
    Passes,
    Lost,
    Spoilt,
}

/// One end.
#[derive(Clone)]
struct End(Arc<Mutex<Line>>, usize);

impl End {
    fn line(&self) -> MutexGuard<'_, Line> {
        self.0.lock().expect("no test panicked with it")
    }
}

impl Transmit for End {
    fn is_busy(&self, _task: &mut Task) -> bool {
        self.line().comes_in[self.1]
    }

    fn transmit(&mut self, task: &mut Task, bytes: &[u8]) {
        let there = 1 - self.1;
        self.line().comes_in[there] = true;
        task.delay(2);
        let time = now(task);
        let mut line = self.line();
        line.comes_in[there] = false;
        let fate = (line.fate)(line.frames);
        line.frames += 1;
        let frame = Frame::decode(&mut bytes.to_vec()).map(|frame| match frame {
            Frame::Data { label, .. } => Some(label.signature),
            _ => None,
        });
        if let Some(signature) = frame.expect("a frame is sent") {
            line.signatures.push(signature);
            line.messages.push(time);
        }
        let mut bytes = bytes.to_vec();
        match fate {
            Fate::Passes => {}
            Fate::Lost => bytes.clear(),
            Fate::Spoilt => bytes[1] ^= 0x40,
        }
        line.toward[there].extend(bytes);
        let signal = line.signals[there];
        drop(line);
        if let Some(signal) = signal {
            signal.post(task);
        }
    }
}

impl Receive for End {
    fn listen(&mut self, _task: &mut Task, signal: &'static Semaphore) {
        self.line().signals[self.1] = Some(signal);
    }

    fn receive(&mut self, _task: &mut Task, buffer: &mut [u8]) -> Option<usize> {
        let bytes = &mut self.line().toward[self.1];
        let length = bytes.iter().position(|byte| *byte == 0)? + 1;
        for (place, byte) in buffer.iter_mut().zip(bytes.drain(..length)) {
            *place = byte;
        }
        Some(length)
    }

    fn overruns(&self, _task: &mut Task) -> u16 {
        self.1 as u16 + 7
    }
}

/// The result of a run, by end.
struct Outcome {
    heard: [Vec<u8>; 2],
    counters: [LinkCounters; 2],
    signatures: Vec<Signature>,
    messages: Vec<Ticks>,
}

fn forever<T>(value: T) -> &'static T {
    Box::leak(Box::new(value))
}

/// Each end sends its messages to the other, one in 60 ticks, over a line whose frames have such fates.
fn run(fate: fn(usize) -> Fate, seeds: [u16; 2]) -> Outcome {
    run_with(fate, seeds, [0; 2].map(|_| vec![60; MESSAGES.into()]))
}

/// As [`run`], with these pauses after each end's messages.
fn run_with(fate: fn(usize) -> Fate, seeds: [u16; 2], pauses: [Vec<Ticks>; 2]) -> Outcome {
    let line = Line {
        toward: Default::default(),
        comes_in: [false; 2],
        signals: [None; 2],
        fate,
        frames: 0,
        signatures: Vec::new(),
        messages: Vec::new(),
    };
    let line = Arc::new(Mutex::new(line));
    let docks = [Dock::Front, Dock::Left];
    let ports = docks.map(|dock| forever(Port::new(dock)));
    let mailboxes = [0; 2].map(|_| forever(Mailbox::new(8)));
    let [nobody, other] = [0; 2].map(|_| forever(Mailbox::new(4)));
    let office = |end: usize| {
        forever(PostOffice {
            router: Router::new(Mcu::Master, RESIDENCE),
            tasks: forever([(TaskCode::AC_RECEIVE, other), (HORMONE, mailboxes[end])]),
            devices: nobody,
            // The office has to find the right one of several.
            links: forever([
                (Dock::Right, other),
                (docks[end], ports[end].mailbox()),
                (docks[1 - end], other),
            ]),
            bridge: nobody,
        })
    };
    let offices = [office(0), office(1)];
    let outcome = Arc::new(Mutex::new([None, None]));
    let written = Arc::clone(&outcome);
    let shared = Arc::clone(&line);
    host::run_for(
        5_000,
        move |boot| {
            for end in 0..2 {
                let stacks: [&'static Stack<8000>; 3] = [0; 3].map(|_| forever(Stack::new()));
                let (port, office, line) = (ports[end], offices[end], End(Arc::clone(&shared), end));
                let (there, signal) = (line.clone(), forever(Semaphore::new(0)));
                let receive = move |task: &mut Task| {
                    receive::run::<_, NoLatches, _>(
                        task,
                        [Incoming::new(port, there)],
                        signal,
                        office,
                        [seeds[end]],
                    )
                };
                stacks[0].start(boot, Priority::P1, receive).expect("the stack is free");
                let send = move |task: &mut Task| send::run(task, port, line, seeds[end]);
                stacks[1].start(boot, Priority::P2, send).expect("the stack is free");
                let (heard_at, written, pauses) = (mailboxes[end], Arc::clone(&written), pauses[end].clone());
                let speak = move |task: &mut Task| {
                    let mut heard = Vec::new();
                    let mut hear = |task: &mut Task, ticks| {
                        for _ in 0..ticks {
                            task.delay(1);
                            while let Some(letter) = heard_at.take(task) {
                                heard.extend(letter.payload());
                            }
                        }
                    };
                    for (number, pause) in (0..).zip(pauses) {
                        let to = Address::beyond(docks[end], HORMONE);
                        let payload = [number];
                        let message =
                            Message::new(to, Address::here(HORMONE), &payload).expect("it is short");
                        assert_eq!(office.deliver(task, message, Source::Task), Ok(()));
                        hear(task, pause);
                    }
                    hear(task, 1_000);
                    written.lock().expect("no test panicked with it")[end] =
                        Some((heard, port.counters(task)));
                    loop {
                        task.delay(1_000);
                    }
                };
                stacks[2].start(boot, Priority::P4, speak).expect("the stack is free");
            }
        },
        |_, _| {},
    );
    let outcome = std::mem::take(&mut *outcome.lock().expect("no test panicked with it"));
    let [(here, counted_here), (there, counted_there)] = outcome.map(|end| end.expect("it came to its end"));
    let mut line = line.lock().expect("no test panicked with it");
    let (signatures, messages) = (std::mem::take(&mut line.signatures), std::mem::take(&mut line.messages));
    Outcome { heard: [here, there], counters: [counted_here, counted_there], signatures, messages }
}

fn all() -> Vec<u8> {
    (0..MESSAGES).collect()
}

#[test]
fn over_a_line_that_loses_nothing_each_message_takes_two_frames() {
    let outcome = run(|_| Fate::Passes, [1, 2]);
    assert_eq!(outcome.heard, [all(), all()]);
    let messages = u16::from(MESSAGES);
    for (end, counters) in outcome.counters.into_iter().enumerate() {
        // A message and an ACK each way.
        let (frames_sent, frames_received) = (2 * messages, 2 * messages);
        let overruns = end as u16 + 7;
        assert_eq!(counters, LinkCounters { frames_sent, frames_received, overruns, ..Default::default() });
    }
}

#[test]
fn an_ack_lets_the_next_message_go_at_once() {
    // Two messages at a time from one end, and none from the other.
    let pauses = [[1, 60].repeat(10), vec![]];
    let messages = run_with(|_| Fate::Passes, [1, 2], pauses).messages;
    // A frame takes two ticks, and an ACK is a frame.
    assert_eq!(messages.windows(2).map(|pair| pair[1].wrapping_sub(pair[0])).min(), Some(4));
}

#[test]
fn what_is_lost_or_spoilt_is_repeated_and_arrives_once_and_in_order() {
    let fates = |number: usize| match (number as u32).wrapping_mul(2_654_435_761) >> 29 {
        3 => Fate::Lost,
        6 => Fate::Spoilt,
        _ => Fate::Passes,
    };
    let outcome = run(fates, [3, 4]);
    assert_eq!(outcome.heard, [all(), all()]);
    for counters in outcome.counters {
        assert!(counters.retries > 5 && counters.errors > 2 && counters.duplicates > 0, "{counters:?}");
        assert_eq!([counters.gave_up, counters.ignored, counters.refused, counters.reflections], [0; 4]);
    }
}

#[test]
fn where_nobody_hears_a_message_is_given_up() {
    let pauses = [0; 2].map(|_| vec![150; 20]);
    let outcome = run_with(|_| Fate::Lost, [5, 6], pauses);
    assert_eq!(outcome.heard, [vec![], vec![]]);
    for counters in outcome.counters {
        assert!(counters.gave_up > 5, "{counters:?}");
        // The last may still be on its way.
        let repeated = u16::from(RETRY_LIMIT) * counters.gave_up;
        assert!((repeated..=repeated + u16::from(RETRY_LIMIT)).contains(&counters.retries), "{counters:?}");
        assert_eq!(counters.frames_received, 0);
    }
}

#[test]
fn a_seed_gives_the_link_its_epoch() {
    let epochs = |seeds| {
        let signatures = run(|_| Fate::Passes, seeds).signatures;
        [Dock::Front, Dock::Left].map(|dock| {
            let epoch = signatures.iter().find(|signature| signature.dock == dock).expect("it sent").epoch;
            assert!(signatures.iter().all(|signature| signature.dock != dock || signature.epoch == epoch));
            epoch
        })
    };
    let ([front, left], [front_again, left_again]) = (epochs([1, 2]), epochs([8, 9]));
    assert!(front != front_again && left != left_again);
}
