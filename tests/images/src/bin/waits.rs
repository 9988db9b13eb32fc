//! One wait of each kind, for the tests of the trace, which observes tasks from outside.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use kernel::{Message, Priority, Queue, Semaphore, Stack};
use tests_images::{finish, start};

board::interrupts!(Interrupts: Tick);

struct Reading;
kernel::pool!(Reading, 2);

static SIGNAL: Semaphore = Semaphore::new(0);
static OTHER: Semaphore = Semaphore::new(0);
static READINGS: Queue<Reading> = Queue::new(2);
static NEVER: Semaphore = Semaphore::new(0);

static FIRST: Stack<208> = Stack::new();
static SECOND: Stack<128> = Stack::new();
static LAST: Stack<128> = Stack::new();

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    start(FIRST.start(boot, Priority::P1, |task| {
        SIGNAL.wait(task);
        task.wait_any([&SIGNAL, &OTHER]);
        let _ = SIGNAL.wait_timeout(task, 5); // in vain
        READINGS.receive(task);
        task.delay(3);
        finish()
    }));
    start(SECOND.start(boot, Priority::P2, |task| {
        SIGNAL.wait(task); // after the first task
        loop {
            NEVER.wait(task);
        }
    }));
    start(LAST.start(boot, Priority::P5, |task| {
        SIGNAL.post(task);
        OTHER.post(task);
        task.delay(10);
        if let Ok(message) = Message::new(task, Reading) {
            let _ = READINGS.send(task, message);
        }
        let second = SECOND.task();
        let _ = second.suspend(task);
        SIGNAL.post(task); // without the suspension it would be ready
        second.resume(task);
        loop {
            task.yield_now();
        }
    }));
});
