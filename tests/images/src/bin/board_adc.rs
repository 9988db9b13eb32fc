//! Converts the voltages of both joint potentiometers. Marks: for each the low byte, then the high byte.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::mark;
use board::superbot::{JOINT_POTENTIOMETER, ROLL_POTENTIOMETER};
use kernel::{Priority, Stack};
use tests_images::{finish, start};

board::interrupts!(Interrupts: Adc);

static TASK: Stack<96> = Stack::new();

#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    kernel::run(|boot| {
        let Some(board) = Board::take(boot) else { return };
        let mut converter = board.adc.start(Interrupts);
        start(TASK.start(boot, Priority::P3, move |task| {
            for channel in [JOINT_POTENTIOMETER, ROLL_POTENTIOMETER] {
                for byte in converter.convert(task, channel).to_le_bytes() {
                    mark(byte);
                }
            }
            finish()
        }));
    })
}
