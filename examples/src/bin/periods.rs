//! A delay counts from now; a period counts from its own last deadline, so that it does not drift.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::halt;
use examples::{println, start};
use kernel::{Period, Priority, Stack, now};

board::interrupts!(Interrupts: Tick);

static CONTROL: Stack<160> = Stack::new();

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    start(CONTROL.start(boot, Priority::P3, |task| {
        for _ in 0..2 {
            task.delay(10);
            println!("{} ms: a delay of 10 and 3 of work", now(task));
            task.delay(3); // in place of work
        }
        let mut period = Period::new(task, 10);
        for work in [3, 3, 12, 3, 3] {
            period.wait(task);
            println!("{} ms: a period of 10 and {} of work", now(task), work);
            task.delay(work);
        }
        println!("missed: {}", period.missed());
        halt()
    }));
});
