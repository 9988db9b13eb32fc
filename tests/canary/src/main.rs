//! The canary's image: it computes while an interrupt wakes a higher task over and over, which computes, too.
//!
//! Marks: the four bytes of each check's digest, low byte first. The simulator reads `WOKEN`.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::hint::black_box;

use board::Board;
use board::debug::mark;
use kernel::{Context, MaskedCell, Priority, Semaphore, Stack};
use tests_images::{PANIC, finish, start};

static PRESSED: Semaphore = Semaphore::new(0);
/// How often the higher task has computed.
#[unsafe(no_mangle)]
static WOKEN: MaskedCell<u16> = MaskedCell::new(0);
static INTRUDER: Stack<128> = Stack::new();
static COMPUTER: Stack<1536> = Stack::new();

board::interrupts!(Interrupts: External);

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.external.start(Interrupts, boot.interrupt(), &PRESSED);
    start(INTRUDER.start(boot, Priority::P1, |task| {
        loop {
            PRESSED.wait(task);
            if black_box(0x1234_5678_u32) * black_box(3) != 0x369d_0368 {
                mark(PANIC);
                finish()
            }
            task.mask(|masked| WOKEN.count(masked));
        }
    }));
    start(COMPUTER.start(boot, Priority::P6, |_| {
        canary::run(|_, digest| digest.to_le_bytes().into_iter().for_each(mark));
        finish()
    }));
});
