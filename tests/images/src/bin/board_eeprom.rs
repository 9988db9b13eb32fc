//! Two tasks use the EEPROM at once.
//!
//! Marks: 1 the first task begins to write, 2 it has written, then the bytes of the other that it reads; 3
//! the other begins to write, 4 it has written, 5 it has written the same again, 6, 7 and 8 when it can
//! neither read nor write beyond the end; then the EEPROM's last byte.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::mark;
use board::eeprom::{OutOfRange, SIZE};
use embedded_storage::{ReadStorage, Storage};
use kernel::{Priority, Semaphore, Stack};
use tests_images::{finish, start};

board::interrupts!(Interrupts: Eeprom);

const PLACE: u16 = 0x0ff;
const NAME: &[u8; 5] = b"spine";

static NEVER: Semaphore = Semaphore::new(0);
static FIRST: Stack<128> = Stack::new();
static OTHER: Stack<128> = Stack::new();

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    let mut storage = board.eeprom.start(Interrupts);
    start(FIRST.start(boot, Priority::P2, move |task| {
        mark(1);
        let written = storage.write(task, SIZE - 3, &[10, 11, 12]);
        mark(if written.is_ok() { 2 } else { 0xff });
        let mut name = [0; NAME.len()];
        let _ = storage.read(task, PLACE, &mut name);
        name.into_iter().for_each(mark);
        loop {
            NEVER.wait(task);
        }
    }));
    start(OTHER.start(boot, Priority::P3, move |task| {
        mark(3);
        for number in [4, 5] {
            let written = storage.write(task, PLACE, NAME);
            mark(if written.is_ok() { number } else { 0xff });
        }
        let read = storage.read(task, SIZE, &mut [0]);
        mark(if read == Err(OutOfRange) { 6 } else { 0xff });
        let written = storage.write(task, SIZE - 2, &[0; 3]);
        mark(if written == Err(OutOfRange) { 7 } else { 0xff });
        // Through embedded-storage's traits.
        let mut storage = storage.with(task);
        let written = storage.write(0x10000, &[0]);
        mark(if written == Err(OutOfRange) { 8 } else { 0xff });
        let mut last = [0];
        let read = storage.read(u32::from(SIZE) - 1, &mut last);
        mark(if read.is_ok() { last[0] } else { 0xff });
        finish()
    }));
});
