//! Measured: a task blocks, and the task that it has preempted continues. The program never ends.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use kernel::{Priority, Semaphore, Stack, Timer};
use tests_images::bench::{begin, end};
use tests_images::start;

board::interrupts!(Interrupts: Tick);

const BLOCK: u8 = 1;

static HIGH: Stack<128> = Stack::new();
static BUSY: Stack<96> = Stack::new();
static ALARM: Timer = Timer::new();
static RUNG: Semaphore = Semaphore::new(0);

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    start(HIGH.start(boot, Priority::P1, |task| {
        loop {
            ALARM.start(task, 2, &RUNG);
            begin::<BLOCK>();
            RUNG.wait(task);
        }
    }));
    start(BUSY.start(boot, Priority::P6, |_| {
        loop {
            end::<BLOCK>();
        }
    }));
});
