//! A post wakes a higher task at once, a lower one later; equals take turns when they yield.
#![no_std]
#![no_main]

use board::debug::mark;
use kernel::{Priority, Semaphore, Stack};
use tests_images::{finish, start};

static HIGH: Stack<96> = Stack::new();
static LOW: Stack<96> = Stack::new();
static EQUAL: Stack<96> = Stack::new();
static WAKE_HIGH: Semaphore = Semaphore::new(0);

kernel::main!(|boot| {
    start(LOW.start(boot, Priority::P5, |task| {
        mark(1);
        WAKE_HIGH.post(task); // -> 2, 3 in the higher task
        mark(4);
        task.yield_now(); // -> 5 in the equal one
        mark(6);
        WAKE_HIGH.post(task);
        mark(8);
        finish()
    }));
    start(EQUAL.start(boot, Priority::P5, |task| {
        mark(5);
        loop {
            task.yield_now();
        }
    }));
    start(HIGH.start(boot, Priority::P2, |task| {
        mark(0);
        WAKE_HIGH.wait(task);
        mark(2);
        mark(3);
        WAKE_HIGH.wait(task);
        mark(7);
        loop {
            WAKE_HIGH.wait(task);
        }
    }));
});
