//! A task writes to the EEPROM while a frame comes in. The software interrupt wakes the frame's task.
//!
//! Marks: 1 the task begins to write, 2 it has written; 3 a frame has come.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

use board::Board;
use board::debug::mark;
use kernel::{Priority, Stack};
use tests_images::{finish, start};

board::interrupts!(Interrupts: Tick, Eeprom, Usart0);

static RECEIVER: Stack<128> = Stack::new();
static WRITER: Stack<128> = Stack::new();

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    let storage = board.eeprom.start(Interrupts);
    let (_, mut receiver) = board.usart0.start(Interrupts);
    start(RECEIVER.start(boot, Priority::P1, move |task| {
        let mut frame = [0; 4];
        loop {
            let length = receiver.wait(task, &mut frame);
            mark(if frame.get(..length) == Some(&[0x55, 0]) { 3 } else { 0xff });
        }
    }));
    start(WRITER.start(boot, Priority::P2, move |task| {
        task.delay(2); // in which two characters can come before the write
        mark(1);
        let written = storage.write(task, 0, &[1, 2]);
        mark(if written.is_ok() { 2 } else { 0xff });
        task.delay(2);
        finish()
    }));
});
