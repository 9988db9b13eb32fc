//! embedded-hal's I2C with `board_i2c_device` alone on the same bus.
//!
//! Marks: 1 to 11 for each successful step, 0x7f in place of a failed one.
//!
//! | mark | step | statuses at the device |
//! |---|---|---|
//! | 1 | write three registers | 60 80 80 80 80 a0 |
//! | 2 | write where, then read them back | 60 80 a0 a8 b8 b8 c0 |
//! | 3 | read the register after them: three bytes were taken, no more | a8 c0 |
//! | 4 | a transaction of adjacent writes, then of adjacent reads | 60 80 80 80 a0 a8 b8 b8 c0 |
//! | 5 | read, write, read | a8 c0 60 80 a0 a8 b8 c0 |
//! | 6 | write to nobody: the address is not acknowledged | |
//! | 7 | read from nobody: likewise | |
//! | 8 | write past the last register: that byte is not acknowledged | 60 80 88 |
//! | 9 | write nothing | 60 a0 |
//! | 10 | read nothing: a byte passes all the same | 60 80 a0 a8 c0 a8 c0 |
//! | 11 | no operations | |
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::mark;
use embedded_hal::i2c::{Error, ErrorKind, I2c, NoAcknowledgeSource, Operation};
use kernel::{Priority, Stack};
use tests_images::{finish, start};

board::interrupts!(Interrupts: I2c);

const DEVICE: u8 = 0x48;
const NOBODY: u8 = 0x49;

const WRONG: u8 = 0x7f;

static TASK: Stack<256> = Stack::new();

/// Marks a step.
fn check(step: u8, is_right: bool) {
    mark(if is_right { step } else { WRONG });
}

fn refused(result: Result<(), impl Error>, source: NoAcknowledgeSource) -> bool {
    result.is_err_and(|error| error.kind() == ErrorKind::NoAcknowledge(source))
}

fn exercise(i2c: &mut impl I2c) {
    let (mut one, mut two, mut three) = ([0; 1], [0; 2], [0; 3]);

    check(1, i2c.write(DEVICE, &[3, 10, 11, 12]).is_ok());
    check(2, i2c.write_read(DEVICE, &[3], &mut three).is_ok() && three == [10, 11, 12]);
    check(3, i2c.read(DEVICE, &mut one).is_ok() && one == [0x86]);

    let mut operations = [
        Operation::Write(&[7]),
        Operation::Write(&[]),
        Operation::Write(&[20, 21]),
        Operation::Read(&mut one),
        Operation::Read(&mut two),
    ];
    let result = i2c.transaction(DEVICE, &mut operations);
    check(4, result.is_ok() && (one, two) == ([0x89], [0x8a, 0x8b]));

    let mut operations = [Operation::Read(&mut one), Operation::Write(&[7]), Operation::Read(&mut two)];
    let result = i2c.transaction(DEVICE, &mut operations);
    check(5, result.is_ok() && (one, two) == ([0x8c], [20, 21]));

    check(6, refused(i2c.write(NOBODY, &[1, 2]), NoAcknowledgeSource::Address));
    check(7, refused(i2c.read(NOBODY, &mut two), NoAcknowledgeSource::Address));
    check(8, refused(i2c.write(DEVICE, &[16, 1, 2]), NoAcknowledgeSource::Data));

    check(9, i2c.write(DEVICE, &[]).is_ok());
    let is_right = i2c.transaction(DEVICE, &mut [Operation::Write(&[0]), Operation::Read(&mut [])]).is_ok();
    check(10, is_right && i2c.read(DEVICE, &mut one).is_ok() && one == [0x81]);
    check(11, i2c.transaction(DEVICE, &mut []).is_ok());
}

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    let mut master = board.i2c.start(Interrupts, boot.interrupt());
    start(TASK.start(boot, Priority::P3, move |task| {
        exercise(&mut master.with(task));
        finish()
    }));
});
