//! An interrupt wakes a higher task, which runs as the interrupt ends; the busy task continues unharmed.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::mark;
use kernel::{Priority, Semaphore, Stack};
use tests_images::{finish, start};

static PRESSED: Semaphore = Semaphore::new(0);
static HIGH: Stack<96> = Stack::new();
static BUSY: Stack<96> = Stack::new();

board::interrupts!(Interrupts: External);

// The ATmega2560 has flash beyond the 128 KB that 16 bits address, in words. With this section before it, the
// linker puts all code there, and makes stubs for functions whose addresses are taken. In QEMU that does not
// work: its `elpm` can't read there, where the initial values of variables would lie.
#[cfg(all(feature = "atmega2560", not(feature = "qemu")))]
core::arch::global_asm!(".pushsection .ctors, \"a\", @progbits", ".skip 0x20000", ".popsection");

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.external.start(Interrupts, boot.interrupt(), &PRESSED);
    start(HIGH.start(boot, Priority::P1, |task| {
        for _ in 0..3 {
            PRESSED.wait(task);
            mark(2);
        }
        finish()
    }));
    start(BUSY.start(boot, Priority::P6, |_| {
        mark(1);
        loop {
            let sum = (0..200u8)
                .fold(0, |sum: u8, value| sum.wrapping_mul(3).wrapping_add(core::hint::black_box(value)));
            mark(if sum == EXPECTED { 3 } else { 0xff });
        }
    }));
});

/// The busy task's result if no register is lost.
const EXPECTED: u8 = {
    let (mut sum, mut value) = (0u8, 0u8);
    while value < 200 {
        sum = sum.wrapping_mul(3).wrapping_add(value);
        value += 1;
    }
    sum
};
