//! Measured: a message to a higher task that waits for it, and sending and receiving without a switch. The
//! program never ends.
#![no_std]
#![no_main]

use kernel::{Message, Priority, Queue, Stack, Task};
use tests_images::bench::{begin, end};
use tests_images::start;

const MESSAGE_TO_HIGHER: u8 = 1;
const SEND: u8 = 2;
const RECEIVE: u8 = 3;

struct Reading([u8; 16]);
kernel::pool!(Reading, 4);

static HIGH: Stack<128> = Stack::new();
static LOW: Stack<160> = Stack::new();
static AWAITED: Queue<Reading> = Queue::new(4);
static KEPT: Queue<Reading> = Queue::new(4);

kernel::main!(|boot| {
    start(HIGH.start(boot, Priority::P1, |task| {
        loop {
            let message = AWAITED.receive(task);
            end::<MESSAGE_TO_HIGHER>();
            drop(message);
        }
    }));
    start(LOW.start(boot, Priority::P3, |task| {
        loop {
            let message = reading(task);
            begin::<MESSAGE_TO_HIGHER>();
            let sent = AWAITED.send(task, message);
            assert!(sent.is_ok());

            let message = reading(task);
            begin::<SEND>();
            let sent = KEPT.send(task, message);
            end::<SEND>();
            assert!(sent.is_ok());
            begin::<RECEIVE>();
            let message = KEPT.receive(task);
            end::<RECEIVE>();
            assert!(message.0 == CONTENT);
        }
    }));
});

const CONTENT: [u8; 16] = *b"as in the robot.";

fn reading(task: &mut Task) -> Message<Reading> {
    match Message::new(task, Reading(CONTENT)) {
        Ok(message) => message,
        Err(_) => panic!(),
    }
}
