//! A pipe is a FIFO on which tasks wait: for a byte, and for space.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::halt;
use examples::{println, start};
use kernel::{Elapsed, LONGEST, Pipe, Priority, Stack, now};

board::interrupts!(Interrupts: Tick);

static PAPER: Pipe<4> = Pipe::new();
static WRITER: Stack<128> = Stack::new();
static PRINTER: Stack<160> = Stack::new();

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    start(WRITER.start(boot, Priority::P2, |task| {
        for byte in *b"kernel" {
            PAPER.put(task, byte); // blocks while there is no space
        }
        println!("{} ms: all is in the pipe", now(task));
        loop {
            task.delay(LONGEST);
        }
    }));
    start(PRINTER.start(boot, Priority::P4, |task| {
        loop {
            match PAPER.take_timeout(task, 10) {
                Ok(byte) => println!("{} ms: {}", now(task), char::from(byte)),
                Err(Elapsed) => {
                    println!("{} ms: nothing for 10 ms", now(task));
                    halt()
                }
            }
            task.delay(3); // it prints
        }
    }));
});
