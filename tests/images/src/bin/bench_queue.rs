//! Measured: a message to a higher task that waits for it, and sending and receiving without a switch.
#![no_std]
#![no_main]

use kernel::{Message, Priority, Queue, Stack};
use tests_images::bench::{begin, end};
use tests_images::{finish, start};

const MESSAGE_TO_HIGHER: u8 = 1;
const SEND: u8 = 2;
const RECEIVE: u8 = 3;

struct Reading([u8; 16]);
kernel::pool!(Reading, 4);

static HIGH: Stack<128> = Stack::new();
static LOW: Stack<160> = Stack::new();
static AWAITED: Queue<Reading> = Queue::new(4);
static KEPT: Queue<Reading> = Queue::new(4);

#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    kernel::run(|boot| {
        start(HIGH.start(boot, Priority::P1, |task| {
            loop {
                let message = AWAITED.receive(task);
                end::<MESSAGE_TO_HIGHER>();
                drop(message);
            }
        }));
        start(LOW.start(boot, Priority::P3, |task| {
            for round in 0..4 {
                let Ok(message) = Message::new(task, Reading([round; 16])) else { panic!() };
                begin::<MESSAGE_TO_HIGHER>();
                let sent = AWAITED.send(task, message);
                assert!(sent.is_ok());
            }
            for round in 0..4 {
                let Ok(message) = Message::new(task, Reading([round; 16])) else { panic!() };
                begin::<SEND>();
                let sent = KEPT.send(task, message);
                end::<SEND>();
                assert!(sent.is_ok());
                begin::<RECEIVE>();
                let message = KEPT.receive(task);
                end::<RECEIVE>();
                assert!(message.0 == [round; 16]);
            }
            finish()
        }));
    })
}
