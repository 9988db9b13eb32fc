//! A task starts the kernel once more: it goes no further, and other tasks run as before.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::debug::mark;
use kernel::{Priority, Semaphore, Stack};
use tests_images::{finish, start};

board::tick_interrupt!();

/// The `init` of a second kernel has run, or its caller has continued.
const WRONG: u8 = 0xff;

static AGAIN: Stack<96> = Stack::new();
static OTHER: Stack<96> = Stack::new();
static SIGNAL: Semaphore = Semaphore::new(0);

kernel::main!(|boot| {
    mark(1);
    start(AGAIN.start(boot, Priority::P5, |task| {
        mark(2);
        SIGNAL.post(task);
        // SAFETY: a second call replaces no stack.
        unsafe { kernel::run(|_| mark(WRONG)) }
    }));
    start(OTHER.start(boot, Priority::P2, |task| {
        for number in 3..6 {
            SIGNAL.wait(task);
            task.delay(1); // a tick preempts the task that goes no further
            mark(number);
            SIGNAL.post(task);
        }
        finish()
    }));
});
