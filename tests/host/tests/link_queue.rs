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

/// A port of its own for each test, with the stacks of its sending task and of the task that writes.
struct Link {
    port: Port,
    sender: Stack<2000>,
    writer: Stack<2000>,
}

impl Link {
    const fn new() -> Self {
        Link { port: Port::new(Dock::Back), sender: Stack::new(), writer: Stack::new() }
    }

    /// Runs the sending task on `line` for a second, and `write` in a task of lower priority.
    fn run(&'static self, line: impl Transmit + Send + 'static, write: fn(&mut Task, &Port)) {
        host::run_for(
            1000,
            |boot| {
                let send = |task: &mut Task| send::run(task, &self.port, line, 1);
                self.sender.start(boot, Priority::P2, send).expect("it is free");
                let write = move |task: &mut Task| {
                    write(task, &self.port);
                    loop {
                        task.delay(LONGEST);
                    }
                };
                self.writer.start(boot, Priority::P4, write).expect("it is free");
            },
            |_, _| {},
        );
    }
}

/// A message of one byte from here to the neighbour; `None` if there is no buffer.
fn letter(task: &mut Task, byte: u8, kind: Kind) -> Option<kernel::Message<Letter>> {
    let (to, from) = (Address::beyond(Dock::Back, TaskCode::HORMONE), Address::here(TaskCode::HORMONE));
    let payload = [byte];
    let message = Message::of_kind(to, from, &payload, kind).expect("it is short");
    kernel::Message::new(task, Letter::of(message)).ok()
}

#[test]
fn of_beats_that_wait_the_last_one_is_sent() {
    static LINK: Link = Link::new();
    LINK.run(Line, |task, port| {
        let mut put = |byte, kind| {
            let letter = letter(task, byte, kind).expect("there is a buffer");
            port.mailbox().put(task, letter).ok().expect("there is room");
        };
        // The first is on its way at once.
        put(0, Kind::Latest);
        put(1, Kind::Latest);
        put(2, Kind::Latest);
        put(3, Kind::Lasting);
        put(4, Kind::Latest);
        task.delay(900);
        assert_eq!(port.counters(task).replaced, 1);
        assert_eq!(port.counters(task).gave_up, 4);
    });
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
    static LINK: Link = Link::new();
    LINK.run(Noisy, |task, port| {
        let letter = |task: &mut Task| letter(task, 7, Kind::Lasting);
        for _ in 0..ROOM {
            let letter = letter(task).expect("there is a buffer");
            port.mailbox().put(task, letter).ok().expect("there is room");
        }
        task.delay(900);
        assert_eq!(port.counters(task).gave_up, ROOM.into());
        let free: Vec<_> = (0..BUFFERS).map(|_| letter(task).expect("no message waits")).collect();
        drop(free);
    });
    let sent_at = SENT_AT.lock().expect("no test panicked with it");
    let first = sent_at.first().expect("frames go out");
    assert!((15..=20).contains(first), "a frame of 6 ms may have come in: {first}");
}
