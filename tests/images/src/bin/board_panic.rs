//! A task panics when the button is pressed; the next start reports where.
//!
//! Marks: 1 after power-up, 2 after a watchdog reset, 4 after another; then, if a panic left a record, the
//! low and high bytes of its line, column and task.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::hint::black_box;

use board::Board;
use board::debug::{halt, mark};
use kernel::{Priority, Semaphore, Stack};

static PRESSED: Semaphore = Semaphore::new(0);
#[unsafe(no_mangle)]
static PANICKER: Stack<128> = Stack::new();

board::interrupts!(Interrupts: External);

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    mark(match board.reset_cause {
        cause if cause.is_watchdog() => 2,
        cause if cause.is_power_on() => 1,
        _ => 4,
    });
    if let Some(record) = board::panic::take(boot) {
        [record.line, record.column, record.task].map(u16::to_le_bytes).into_iter().flatten().for_each(mark);
    }
    board.external.start(Interrupts, boot.interrupt(), &PRESSED);
    let started = PANICKER.start(boot, Priority::P4, |task| {
        let mut values = [1, 2, 3];
        loop {
            PRESSED.wait(task);
            values[black_box(3)] = 4; // panics
            mark(values[0]);
        }
    });
    if started.is_err() {
        halt()
    }
});

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    board::panic::record_and_reset(info)
}
