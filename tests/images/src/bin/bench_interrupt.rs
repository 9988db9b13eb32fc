//! Measured: an interrupt that wakes a higher task while a lower one is busy.
//!
//! The simulator raises the interrupt; the program never ends. `BUSY` is the stack whose use is measured.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::external::External;
use board::interrupts::Serves;
use kernel::{Priority, Semaphore, Stack};
use tests_images::bench::{begin, busy, end};
use tests_images::start;

const WOKEN: u8 = 1;
const BUSY_BEGINS: u8 = 2;

static HIGH: [Stack<96>; 2] = [const { Stack::new() }; 2];
#[unsafe(no_mangle)]
static BUSY: Stack<128> = Stack::new();
static PRESSED: Semaphore = Semaphore::new(0);
static OTHER: Semaphore = Semaphore::new(0);

// The board's own handler looks up which semaphore to post, but here the kernel alone is measured.
kernel::interrupt! {
    fn __vector_5(interrupt) { PRESSED.post(interrupt); }
    fn __vector_6(interrupt) { OTHER.post(interrupt); }
}

#[derive(Clone, Copy)]
struct Interrupts;
// SAFETY: INT4 is vector 5, above.
unsafe impl Serves<External> for Interrupts {}

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.external.start(Interrupts, boot.interrupt(), &PRESSED);
    let [first, second] = &HIGH;
    start(first.start(boot, Priority::P1, |task| {
        loop {
            PRESSED.wait(task);
            end::<WOKEN>();
        }
    }));
    start(second.start(boot, Priority::P2, |task| {
        loop {
            OTHER.wait(task);
        }
    }));
    start(BUSY.start(boot, Priority::P6, |_| {
        begin::<BUSY_BEGINS>();
        loop {
            busy();
        }
    }));
});
