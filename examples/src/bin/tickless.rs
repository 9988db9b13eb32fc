//! The same times with fewer interrupts: while all tasks wait, there is no tick.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::halt;
use examples::{println, start};
use kernel::{Period, Priority, Semaphore, Stack, now};

board::interrupts!(Interrupts: Tick);

static NEVER: Semaphore = Semaphore::new(0);

static SAMPLER: Stack<160> = Stack::new();
static PATIENT: Stack<160> = Stack::new();

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    start(SAMPLER.start(boot, Priority::P3, |task| {
        let mut period = Period::new(task, 200);
        loop {
            period.wait(task);
            println!("{} ms: a sample", now(task));
        }
    }));
    start(PATIENT.start(boot, Priority::P4, |task| {
        let has_come = NEVER.wait_timeout(task, 700);
        println!("{} ms: has it come? {}", now(task), has_come.is_ok());
        halt()
    }));
});
