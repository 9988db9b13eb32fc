//! Messages arrive in order; a full queue and an empty pool give the value back; a drop frees the buffer.
#![no_std]
#![no_main]

use board::debug::mark;
use kernel::{Message, Priority, Queue, Stack};
use tests_images::{finish, start};

struct Reading(u8);
kernel::pool!(Reading, 3);

static READINGS: Queue<Reading> = Queue::new(2);
static RECEIVER: Stack<96> = Stack::new();
static SENDER: Stack<128> = Stack::new();

kernel::main!(|boot| {
    start(SENDER.start(boot, Priority::P2, |task| {
        for value in 0x10..0x14 {
            match Message::new(task, Reading(value)) {
                Err(exhausted) => mark(0xe0 | (exhausted.0.0 & 0x0f)), // not before 14
                Ok(message) => match READINGS.send(task, message) {
                    Ok(()) => mark(value),
                    // 12 and 13 find no room, and go back to the pool.
                    Err(full) => mark(0xf0 | (full.0.0 & 0x0f)),
                },
            }
        }
        let (first, second) = (READINGS.try_receive(task), READINGS.try_receive(task));
        mark(if first.as_ref().is_some_and(|message| message.0 == 0x10) { 1 } else { 0xff });
        mark(if second.as_ref().is_some_and(|message| message.0 == 0x11) { 2 } else { 0xff });
        let third = Message::new(task, Reading(0x14));
        mark(if third.is_ok() { 3 } else { 0xff });
        mark(if Message::new(task, Reading(0x15)).is_err() { 4 } else { 0xff }); // all three are out
        drop((first, second));
        for value in 0x20..0x22 {
            if let Ok(message) = Message::new(task, Reading(value)) {
                mark(value);
                let _ = READINGS.send(task, message);
            }
        }
        task.yield_now(); // the receiver is lower: it has not run
        mark(5);
        READINGS_TAKEN.wait(task);
        finish()
    }));
    start(RECEIVER.start(boot, Priority::P4, |task| {
        for _ in 0..2 {
            let message = READINGS.receive(task);
            mark(message.0 | 0x80);
        }
        READINGS_TAKEN.post(task);
        loop {
            drop(READINGS.receive(task));
        }
    }));
});

static READINGS_TAKEN: kernel::Semaphore = kernel::Semaphore::new(0);
