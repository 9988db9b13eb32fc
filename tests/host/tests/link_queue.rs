//! A dock's sending task and its queue, on the host, with a neighbour that acknowledges nothing.

use std::sync::Mutex;

use kernel::{LONGEST, Priority, Stack, Task, Ticks, host, now};
use tasks::device::Transmit;
use tasks::dock::Dock;
use tasks::link::frame::Frame;
use tasks::link::port::{Port, ROOM};
use tasks::link::send;
use tasks::message::{Address, BUFFERS, Kind, Letter, Message, TaskCode};

/// The payloads of the messages that went out, each once.
static SENT: Mutex<Vec<Vec<u8>>> = Mutex::new(Vec::new());

struct Line;

impl Transmit for Line {
    fn is_busy(&self, _task: &mut Task) -> bool {
        false
    }

    fn transmit(&mut self, _task: &mut Task, bytes: &[u8]) {
        let mut bytes = bytes.to_vec();
        let Ok(Frame::Data { payload, .. }) = Frame::decode(&mut bytes) else { panic!("no message") };
        let mut sent = SENT.lock().expect("no test panicked with it");
        if sent.last().is_none_or(|last| last != payload) {
            sent.push(payload.to_vec());
        }
    }
}

#[test]
fn of_beats_that_wait_the_last_one_is_sent() {
    static PORT: Port = Port::new(Dock::Back);
    static SENDER: Stack<2000> = Stack::new();
    static WRITER: Stack<2000> = Stack::new();
    host::run_for(
        1000,
        |boot| {
            SENDER.start(boot, Priority::P2, |task| send::run(task, &PORT, Line, 1)).expect("it is free");
            let write = |task: &mut Task| {
                let (to, from) =
                    (Address::beyond(Dock::Back, TaskCode::HORMONE), Address::here(TaskCode::HORMONE));
                let mut put = |byte, kind| {
                    let payload = [byte];
                    let message = Message::of_kind(to, from, &payload, kind).expect("it is short");
                    let letter = kernel::Message::new(task, Letter::of(message)).expect("there is a buffer");
                    PORT.mailbox().put(task, letter).ok().expect("there is room");
                };
                // The first is on its way at once.
                put(0, Kind::Latest);
                put(1, Kind::Latest);
                put(2, Kind::Latest);
                put(3, Kind::Lasting);
                put(4, Kind::Latest);
                task.delay(900);
                assert_eq!(PORT.counters(task).replaced, 1);
                assert_eq!(PORT.counters(task).gave_up, 4);
                loop {
                    task.delay(LONGEST);
                }
            };
            WRITER.start(boot, Priority::P4, write).expect("it is free");
        },
        |_, _| {},
    );
    assert_eq!(*SENT.lock().expect("no test panicked with it"), [[0], [2], [3], [4]]);
}

/// When each frame went out.
static SENT_AT: Mutex<Vec<Ticks>> = Mutex::new(Vec::new());

/// A line that is always busy.
struct Noisy;

impl Transmit for Noisy {
    fn is_busy(&self, _task: &mut Task) -> bool {
        true
    }

    fn transmit(&mut self, task: &mut Task, _bytes: &[u8]) {
        let time = now(task);
        SENT_AT.lock().expect("no test panicked with it").push(time);
    }
}

/// The messages that wait would take the buffers of all other tasks for as long as the noise lasts.
#[test]
fn noise_that_goes_on_keeps_no_buffer() {
    static PORT: Port = Port::new(Dock::Back);
    static SENDER: Stack<2000> = Stack::new();
    static WRITER: Stack<2000> = Stack::new();
    host::run_for(
        1000,
        |boot| {
            SENDER.start(boot, Priority::P2, |task| send::run(task, &PORT, Noisy, 1)).expect("it is free");
            let write = |task: &mut Task| {
                let (to, from) =
                    (Address::beyond(Dock::Back, TaskCode::HORMONE), Address::here(TaskCode::HORMONE));
                let letter = |task: &mut Task| {
                    let message = Message::new(to, from, &[7]).expect("it is short");
                    kernel::Message::new(task, Letter::of(message))
                };
                for _ in 0..ROOM {
                    let letter = letter(task).expect("there is a buffer");
                    PORT.mailbox().put(task, letter).ok().expect("there is room");
                }
                task.delay(900);
                assert_eq!(PORT.counters(task).gave_up, ROOM.into());
                let free: Vec<_> = (0..BUFFERS).map(|_| letter(task).expect("no message waits")).collect();
                drop(free);
                loop {
                    task.delay(LONGEST);
                }
            };
            WRITER.start(boot, Priority::P4, write).expect("it is free");
        },
        |_, _| {},
    );
    let sent_at = SENT_AT.lock().expect("no test panicked with it");
    let first = sent_at.first().expect("frames go out");
    assert!((15..=20).contains(first), "a frame of 6 ms may have come in: {first}");
}
