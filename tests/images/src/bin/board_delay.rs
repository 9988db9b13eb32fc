//! A delay of 66 s, in the parts that the tick's 16 bits allow. Another task keeps the CPU busy for 10 ms
//! where a part ends.
//!
//! Marks: 1 and 2 around the delay.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::mark;
use board::delay::Delay;
use embedded_hal::delay::DelayNs;
use kernel::{LONGEST, Priority, Stack};
use tests_images::{finish, start};

board::interrupts!(Interrupts: Tick);

static DELAYED: Stack<128> = Stack::new();
static BUSY: Stack<128> = Stack::new();

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    start(BUSY.start(boot, Priority::P3, |task| {
        loop {
            task.delay(LONGEST - 1);
            for _ in 0..20 {
                Delay::new(task).delay_us(500);
            }
        }
    }));
    start(DELAYED.start(boot, Priority::P4, |task| {
        mark(1);
        Delay::new(task).delay_ms(66_000);
        mark(2);
        finish()
    }));
});
