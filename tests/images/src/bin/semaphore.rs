//! Signals are counted; waiting tasks are woken by priority, and by arrival among equals.
#![no_std]
#![no_main]

use board::debug::mark;
use kernel::{Boot, Priority, Semaphore, Stack};
use tests_images::{finish, start};

static GATE: Semaphore = Semaphore::new(0);
static STORE: Semaphore = Semaphore::new(2);
static WAITERS: [Stack<96>; 4] = [const { Stack::new() }; 4];
static NEVER: Semaphore = Semaphore::new(0);
static LAST: Stack<96> = Stack::new();

kernel::main!(|boot: &mut Boot| {
    let tasks = [(Priority::P3, 0x31), (Priority::P1, 0x10), (Priority::P3, 0x32), (Priority::P2, 0x20)];
    for (stack, (priority, number)) in WAITERS.iter().zip(tasks) {
        start(stack.start(boot, priority, move |task| {
            GATE.wait(task);
            mark(number);
            loop {
                NEVER.wait(task);
            }
        }));
    }
    start(LAST.start(boot, Priority::P7, |task| {
        for _ in 0..4 {
            GATE.post(task); // -> 10, 20, 31, 32
        }
        mark(1);
        STORE.post(task);
        for _ in 0..3 {
            STORE.wait(task);
            mark(2);
        }
        mark(if STORE.try_wait(task) { 0xff } else { 3 });
        finish()
    }));
});
