//! Counts ticks with the kernel's function, again and again; the harness makes the vector count the same
//! ones.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::debug::mark;
use kernel::{Context, Priority, Stack};
use tests_images::{finish, start};

board::tick_interrupt!();

/// The harness raises the tick here.
const BY_VECTOR: u8 = 1;
/// The harness sets the ticks here.
const BY_FUNCTION: u8 = 2;
/// A tick was counted; plus one if a deadline has come.
const COUNTED: u8 = 3;

/// More rounds than the harness uses.
const ROUNDS: u16 = 6_000;

static TASK: Stack<96> = Stack::new();

kernel::main!(|boot| {
    start(TASK.start(boot, Priority::P1, |task| {
        for _ in 0..ROUNDS {
            mark(BY_VECTOR);
            mark(BY_FUNCTION);
            // SAFETY: nothing else drives the tick here, and the test sets its time anew.
            let is_due = task.mask(|masked| unsafe { kernel::count_tick(masked) });
            mark(COUNTED + u8::from(is_due));
        }
        finish()
    }));
});
