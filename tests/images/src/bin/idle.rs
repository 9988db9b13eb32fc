//! For a minute nothing but a mark each second, 0 to 60. At each press of the button it marks the present
//! tick, its low seven bits as a mark from 0x80 on, and 3 ticks later 0x7f.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::mark;
use kernel::{Period, Priority, Semaphore, Stack};
use tests_images::{finish, start};

board::interrupts!(Interrupts: Tick, External);

static PRESSED: Semaphore = Semaphore::new(0);
static SECONDS: Stack<128> = Stack::new();
static BUTTON: Stack<128> = Stack::new();

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    board.external.start(Interrupts, boot.interrupt(), &PRESSED);
    start(SECONDS.start(boot, Priority::P3, |task| {
        let mut period = Period::new(task, 1000);
        for second in 0..=60 {
            mark(second);
            period.wait(task);
        }
        finish()
    }));
    start(BUTTON.start(boot, Priority::P2, |task| {
        loop {
            PRESSED.wait(task);
            mark(0x80 | kernel::now(task) as u8);
            task.delay(3);
            mark(0x7f);
        }
    }));
});
