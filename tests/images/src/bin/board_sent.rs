//! USART0 sends frames from a slice that is reused as soon as [`Transmit::transmit`] returns. Before each
//! frame the line's semaphore is posted, as if frames had left the line already.
//!
//! Marks: the length of a frame as it begins; [`DONE`] when `transmit` returns.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

use core::hint::black_box;

use board::debug::mark;
use board::serial::Transmitter;
use board::usart::PORT0;
use kernel::{Context, Interrupt, Priority, Stack, Task};
use tasks::device::Transmit;
use tests_images::{finish, start};

board::interrupts!(Interrupts: Tick, Usart0);

/// How often the semaphore is posted before each frame.
const SIGNALS: [usize; 3] = [0, 1, 3];

const LENGTH: usize = 40;
const BYTE: u8 = 0x55;
/// The byte that overwrites the slice afterwards.
const GONE: u8 = 0xee;

const DONE: u8 = 0x80;

static SENDER: Stack<200> = Stack::new();

fn send(mut line: Transmitter, task: &mut Task) {
    for signals in SIGNALS {
        for _ in 0..signals {
            // SAFETY: interrupts are masked, and no task waits that this could make ready.
            task.mask(|_| PORT0.finish(&mut unsafe { Interrupt::assume() }));
        }
        let mut frame = [BYTE; LENGTH];
        mark(LENGTH as u8);
        line.transmit(task, &frame);
        mark(DONE);
        black_box(&mut frame).fill(GONE);
        task.delay(20);
    }
}

kernel::main!(|boot| {
    let Some(board) = board::Board::take(boot) else { return };
    board.tick.start(Interrupts);
    let (transmitter, _) = board.usart0.start(Interrupts);
    start(SENDER.start(boot, Priority::P3, |task| {
        send(transmitter, task);
        finish()
    }));
});
