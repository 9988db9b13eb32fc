//! No timer is armed until the button is pressed: then a mark, another after 3 ticks, and another after 3
//! more.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::mark;
use kernel::{Priority, Semaphore, Stack};
use tests_images::start;

board::interrupts!(Interrupts: Tick, External);

static PRESSED: Semaphore = Semaphore::new(0);
static BUTTON: Stack<128> = Stack::new();

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    board.external.start(Interrupts, boot.interrupt(), &PRESSED);
    start(BUTTON.start(boot, Priority::P2, |task| {
        loop {
            PRESSED.wait(task);
            mark(kernel::now(task) as u8 & 0x7f);
            task.delay(3);
            mark(0x80);
            task.delay(3);
            mark(0x81);
        }
    }));
});
