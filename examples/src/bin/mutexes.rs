//! A task that holds a mutex runs at its ceiling: a higher task waits for at most one locked section, never
//! for a task in between.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::halt;
use core::hint::black_box;
use examples::{println, start};
use kernel::{LONGEST, Mutex, Priority, Stack, now};

board::interrupts!(Interrupts: Tick);

/// The ceiling is the priority of the highest task that locks it.
static TOTAL: Mutex<u16> = Mutex::new(Priority::P1, 0);
static HIGH: Stack<128> = Stack::new();
static MIDDLE: Stack<128> = Stack::new();
static LOW: Stack<128> = Stack::new();

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    start(HIGH.start(boot, Priority::P1, |task| {
        task.delay(2);
        let total = *TOTAL.lock(task); // does not wait: a holder would run above this task
        println!("{} ms: high finds {}", now(task), total);
        loop {
            task.delay(LONGEST);
        }
    }));
    start(MIDDLE.start(boot, Priority::P3, |task| {
        task.delay(1);
        println!("{} ms: middle", now(task));
        loop {
            task.delay(LONGEST);
        }
    }));
    start(LOW.start(boot, Priority::P5, |task| {
        println!("{} ms: low begins", now(task));
        let mut total = TOTAL.lock(task);
        for _ in 0..3000 {
            *total = black_box(*total + 1); // some milliseconds, in which both others become ready
        }
        drop(total); // the ceiling is left: high runs, and then middle
        println!("{} ms: low ends", now(task));
        halt()
    }));
});
