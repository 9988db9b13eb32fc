//! A preempted task keeps its RAMPZ. The image is not for an MCU without that register.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::arch::asm;
use core::hint::black_box;

use board::Board;
use board::debug::mark;
use kernel::{Priority, Semaphore, Stack};
use tests_images::{finish, start};

static PRESSED: Semaphore = Semaphore::new(0);
static HIGH: Stack<96> = Stack::new();
static BUSY: Stack<96> = Stack::new();

/// Values of RAMPZ: one for each 64 KB of flash.
const PAGES: u8 = if cfg!(feature = "atmega2560") { 4 } else { 2 };

board::interrupts!(Interrupts: External);

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.external.start(Interrupts, boot.interrupt(), &PRESSED);
    start(HIGH.start(boot, Priority::P1, |task| {
        loop {
            PRESSED.wait(task);
            set_rampz(PAGES - 1 - rampz());
            mark(2);
        }
    }));
    start(BUSY.start(boot, Priority::P6, |_| {
        for page in 0..PAGES {
            set_rampz(page);
            mark(1); // -> 2 in the higher task
            (0..100_u8).for_each(|count| _ = black_box(count));
            mark(0x10 + rampz());
        }
        finish()
    }));
});

fn rampz() -> u8 {
    let value;
    // SAFETY: reads a register.
    unsafe { asm!("in {}, 0x3b", out(reg) value, options(nomem, nostack, preserves_flags)) };
    value
}

fn set_rampz(value: u8) {
    // SAFETY: only `elpm` uses this register, and nothing here does.
    unsafe { asm!("out 0x3b, {}", in(reg) value, options(nomem, nostack, preserves_flags)) };
}
