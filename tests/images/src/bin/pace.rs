//! Computes and switches between two tasks for a long time, to measure the speed of simulators. The begin and
//! the end are marked.
#![no_std]
#![no_main]

use core::hint::black_box;

use board::debug::mark;
use kernel::{Priority, Semaphore, Stack};
use tests_images::{finish, start};

const BEGIN: u8 = 1;
const END: u8 = 2;

/// Some 400 cycles each round.
const ROUNDS: u32 = 300_000;

static HIGH: Stack<96> = Stack::new();
static LOW: Stack<96> = Stack::new();
static WAKE: Semaphore = Semaphore::new(0);

kernel::main!(|boot| {
    start(HIGH.start(boot, Priority::P1, |task| {
        loop {
            WAKE.wait(task);
        }
    }));
    start(LOW.start(boot, Priority::P3, |task| {
        mark(BEGIN);
        let mut state = 1_u16;
        for _ in 0..ROUNDS {
            for _ in 0..8 {
                // Xorshift.
                state ^= state << 7;
                state ^= state >> 9;
                state ^= state << 8;
            }
            black_box(state);
            WAKE.post(task);
        }
        mark(END);
        finish()
    }));
});
