//! The task of both MCUs of the crowd: it writes four registers of the device, and reads them back.
//!
//! Marks: 4 each time that the registers were right, 5 after the last, 0x7e for anything wrong; and the marks
//! of the packets, see `board_twi/exchange.rs`.

use board::debug::mark;
use board::interrupts::Serves;
use board::twi::{self, Master};
use embedded_hal::i2c::I2c;
use kernel::{Boot, LONGEST, Never, Priority, Stack, Task};
use tests_images::start;

const DEVICE: u8 = 0x48;

/// How many times each side writes and reads.
const TIMES: u8 = 50;

const RIGHT: u8 = 4;
const THROUGH: u8 = 5;
const WRONG: u8 = 0x7e;

static TASK: Stack<256> = Stack::new();

/// Starts the task that uses the four registers from `first` on.
pub fn begin(boot: &mut Boot, interrupts: impl Serves<twi::I2c>, i2c: twi::I2c, first: u8) {
    let master = i2c.start(interrupts, boot.interrupt());
    start(TASK.start(boot, Priority::P4, move |task| use_device(task, master, first)));
}

fn use_device(task: &mut Task, mut master: Master, first: u8) -> Never {
    let mut i2c = master.with(task);
    for time in 0..TIMES {
        let written = [first, time, !time, first, time ^ first];
        let mut read = [0; 4];
        let is_right = i2c.write(DEVICE, &written).is_ok()
            && i2c.write_read(DEVICE, &[first], &mut read).is_ok()
            && written.get(1..) == Some(&read);
        mark(if is_right { RIGHT } else { WRONG });
    }
    mark(THROUGH);
    loop {
        task.delay(LONGEST);
    }
}
