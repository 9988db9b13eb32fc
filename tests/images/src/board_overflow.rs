//! A task overflows its stack after power-up; the next start reports which.
//!
//! Marks: 1 after power-up, 2 after a watchdog reset; then, if there is a record, the low and high bytes of
//! its line, column and task.
#![no_std]
#![no_main]

use core::hint::black_box;

use board::Board;
use board::debug::{halt, mark};
use kernel::{Never, Priority, Semaphore, Stack, Task};

static NEVER: Semaphore = Semaphore::new(0);
/// Two bytes less than the task needs when it blocks.
#[unsafe(no_mangle)]
static SMALL: Stack<86> = Stack::new();

kernel::stack_overflow!(board::panic::record_overflow_and_reset);

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    mark(if board.reset_cause.is_watchdog() { 2 } else { 1 });
    let record = board::panic::take(boot);
    if let Some(record) = record {
        [record.line, record.column, record.task].map(u16::to_le_bytes).into_iter().flatten().for_each(mark);
    } else if SMALL.start(boot, Priority::P4, wait_with_much_on_the_stack).is_err() {
        halt()
    }
});

fn wait_with_much_on_the_stack(task: &mut Task) -> Never {
    let bytes = black_box([0_u8; 64]);
    loop {
        NEVER.wait(task);
        black_box(&bytes);
    }
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    board::panic::record_and_reset(info)
}
