//! Measured: a yield, a post and a wait that switch, and those that do not. The program never ends.
//!
//! There are at least two objects of each kind, so that the compiler can't specialise code for a single one.
#![no_std]
#![no_main]

use kernel::{Priority, Semaphore, Stack};
use tests_images::bench::{begin, end};
use tests_images::start;

const YIELD: u8 = 1;
const POST_TO_HIGHER: u8 = 2;
const BLOCK_TO_LOWER: u8 = 3;
const POST: u8 = 4;
const WAIT: u8 = 5;
const POST_BY_CALL: u8 = 6;

static HIGHEST: Stack<96> = Stack::new();
static HIGH: Stack<96> = Stack::new();
static LOW: Stack<96> = Stack::new();
static EQUAL: Stack<96> = Stack::new();
static WAKE: Semaphore = Semaphore::new(0);
static CALL: Semaphore = Semaphore::new(0);
static STORE: Semaphore = Semaphore::new(0);

kernel::main!(|boot| {
    start(HIGH.start(boot, Priority::P1, |task| {
        loop {
            begin::<BLOCK_TO_LOWER>();
            WAKE.wait(task);
            end::<POST_TO_HIGHER>();
        }
    }));
    start(HIGHEST.start(boot, Priority::P0, |task| {
        loop {
            CALL.wait(task);
            end::<POST_BY_CALL>();
        }
    }));
    // Nothing is alive across a call, so the figures are the kernel's alone.
    start(LOW.start(boot, Priority::P3, |task| {
        loop {
            begin::<POST_TO_HIGHER>();
            WAKE.post_in_loop(task);
            end::<BLOCK_TO_LOWER>();
            begin::<POST_BY_CALL>();
            CALL.post(task);
            begin::<POST>();
            STORE.post(task);
            end::<POST>();
            begin::<WAIT>();
            STORE.wait(task);
            end::<WAIT>();
            begin::<YIELD>();
            task.yield_now();
            end::<YIELD>();
        }
    }));
    start(EQUAL.start(boot, Priority::P3, |task| {
        loop {
            begin::<YIELD>();
            task.yield_now();
            end::<YIELD>();
        }
    }));
});
