//! The UART in software sends each received frame back. While `HOLDS_UP` is set, a task masks interrupts for
//! 450 cycles again and again.
//!
//! Marks: 0x7f for a byte that was lost.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

use core::arch::asm;

use board::debug::mark;
use board::serial::{Receiver, Transmitter};
use kernel::{Context, MaskedCell, Never, Priority, Stack, Task};
use tasks::device::{Receive, Transmit};
use tests_images::start;

board::interrupts!(Interrupts: Tick, SoftUart);

const LOST: u8 = 0x7f;

/// Longer than any frame that a line takes.
const BUFFER: usize = 300;

static ECHO: Stack<{ 170 + BUFFER }> = Stack::new();
static HOLD_UP: Stack<120> = Stack::new();

#[unsafe(no_mangle)]
static HOLDS_UP: MaskedCell<bool> = MaskedCell::new(false);

fn hold_up(task: &mut Task) -> Never {
    loop {
        let holds_up = task.mask(|masked| HOLDS_UP.get(masked));
        if !holds_up {
            task.delay(1);
            continue;
        }
        task.mask(|_| spin::<150>());
        spin::<80>(); // without this ticks would be held up for ever, and bytes would seem to come late
    }
}

/// Takes three cycles for each iteration.
#[inline(always)]
fn spin<const TURNS: u8>() {
    // SAFETY: it counts in a register.
    unsafe {
        asm!(
            "2:",
            "dec {turns}", // 1
            "brne 2b",     // 2
            turns = inout(reg_upper) TURNS => _,
            options(nostack, nomem),
        );
    }
}

fn echo(task: &mut Task, mut receiver: Receiver, mut transmitter: Transmitter) -> Never {
    let mut frame = [0; BUFFER];
    loop {
        let length = receiver.wait(task, &mut frame);
        if receiver.overruns(task) != 0 {
            mark(LOST);
        }
        transmitter.transmit(task, frame.get(..length).unwrap_or(&frame));
    }
}

kernel::main!(|boot| {
    let Some(board) = board::Board::take(boot) else { return };
    board.tick.start(Interrupts);
    let (transmitter, receiver) = board.soft_uart.start(Interrupts, boot.interrupt());
    start(HOLD_UP.start(boot, Priority::P7, hold_up));
    start(ECHO.start(boot, Priority::P3, |task| echo(task, receiver, transmitter)));
});
