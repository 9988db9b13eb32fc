//! Frames that come to USART0 and to the UART in software, while the CPU sleeps otherwise.
//!
//! Marks: the length of each frame, with 0x80 added for the UART in software.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

use board::debug::mark;
use board::serial::Receiver;
use kernel::{Never, Priority, Stack, Task};
use tests_images::start;

board::interrupts!(Interrupts: Tick, Usart0, SoftUart);

static USART: Stack<200> = Stack::new();
static SOFT_UART: Stack<200> = Stack::new();

fn receive(mut receiver: Receiver, task: &mut Task, base: u8) -> Never {
    let mut frame = [0; 40];
    loop {
        mark(base | receiver.wait(task, &mut frame) as u8);
    }
}

kernel::main!(|boot| {
    let Some(board) = board::Board::take(boot) else { return };
    board.tick.start(Interrupts);
    let (_, usart) = board.usart0.start(Interrupts);
    let (_, soft_uart) = board.soft_uart.start(Interrupts, boot);
    start(USART.start(boot, Priority::P3, |task| receive(usart, task, 0)));
    start(SOFT_UART.start(boot, Priority::P3, |task| receive(soft_uart, task, 0x80)));
});
