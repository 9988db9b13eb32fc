//! The EEPROM keeps its content without power. A write takes 8.5 ms per byte, while other tasks run.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::halt;
use board::eeprom::{OutOfRange, SIZE};
use examples::{println, start};
use kernel::{Priority, Stack, now};

board::interrupts!(Interrupts: Tick, Eeprom);

/// The address of the volume and the balance.
const SETTINGS: u16 = 0x10;

static RADIO: Stack<160> = Stack::new();
static CLOCK: Stack<128> = Stack::new();

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    let storage = board.eeprom.start(Interrupts); // may be copied: each task that uses it has one
    start(RADIO.start(boot, Priority::P2, move |task| {
        let mut settings = [0; 2];
        let read = storage.read(task, SETTINGS, &mut settings);
        println!("{} ms: {:?}, read: {}", now(task), settings, read.is_ok());
        for _ in 0..2 {
            let written = storage.write(task, SETTINGS, &[11, 5]);
            println!("{} ms: written: {}", now(task), written.is_ok());
        }
        let beyond = storage.write(task, SIZE - 1, &[11, 5]);
        println!("beyond the end: {}", if beyond == Err(OutOfRange) { "refused" } else { "written" });
        halt()
    }));
    start(CLOCK.start(boot, Priority::P5, |task| {
        loop {
            task.delay(6);
            println!("{} ms: the clock runs on", now(task));
        }
    }));
});
