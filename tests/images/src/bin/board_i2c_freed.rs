//! Reads from `board_i2c_device` for longer than packets wait for the bus. Another task frees that meanwhile.
//!
//! Marks: 1 when that read has ended with the error, 2 when another one was right, 0x7f in place of either.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::mark;
use board::superbot::{MASTER, SLAVE};
use embedded_hal::i2c::{ErrorKind, I2c};
use kernel::{LONGEST, Priority, Semaphore, Stack};
use tasks::device::Bus;
use tests_images::{finish, start};

board::interrupts!(Interrupts: Tick, I2c);

const DEVICE: u8 = 0x48;

const WRONG: u8 = 0x7f;

static READER: Stack<500> = Stack::new();
static FREER: Stack<200> = Stack::new();
static SIGNAL: Semaphore = Semaphore::new(0);

/// Marks a step.
fn check(step: u8, is_right: bool) {
    mark(if is_right { step } else { WRONG });
}

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    let mut bus = board.twi.start(Interrupts, boot.interrupt(), MASTER.address, SLAVE.address, &SIGNAL);
    let mut master = board.i2c.start(Interrupts, boot.interrupt());
    start(FREER.start(boot, Priority::P3, move |task| {
        task.delay(4);
        bus.free(task);
        loop {
            task.delay(LONGEST);
        }
    }));
    start(READER.start(boot, Priority::P4, move |task| {
        let mut i2c = master.with(task);
        let (mut long, mut one) = ([0; 255], [0; 1]);
        check(1, i2c.read(DEVICE, &mut long) == Err(ErrorKind::Bus));
        check(2, i2c.write_read(DEVICE, &[3], &mut one).is_ok() && one == [0x83]);
        finish()
    }));
});
