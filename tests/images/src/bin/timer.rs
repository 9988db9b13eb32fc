//! Delays, timers and periods end on their tick: 16,000 cycles each.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::mark;
use kernel::{Period, Priority, Semaphore, Stack, Timer, now};
use tests_images::{finish, start};

board::interrupts!(Interrupts: Tick);

static DELAYS: [Stack<128>; 3] = [const { Stack::new() }; 3];
static TIMED: Stack<160> = Stack::new();
static FIRST: Timer = Timer::new();
static SECOND: Timer = Timer::new();
static DUE: Semaphore = Semaphore::new(0);

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    for (stack, (ticks, number)) in DELAYS.iter().zip([(7, 0x17), (3, 0x13), (5, 0x15)]) {
        start(stack.start(boot, Priority::P2, move |task| {
            task.delay(ticks);
            mark(number); // 13, 15, 17
            loop {
                task.delay(kernel::LONGEST);
            }
        }));
    }
    start(TIMED.start(boot, Priority::P4, |task| {
        task.delay(10);
        mark(0x20);
        FIRST.start(task, 4, &DUE);
        SECOND.start(task, 2, &DUE);
        FIRST.start(task, 6, &DUE); // restarted
        DUE.wait(task);
        mark(0x21); // 2 ticks later
        DUE.wait(task);
        mark(0x22); // 4 ticks later
        SECOND.start(task, 1, &DUE);
        mark(if SECOND.cancel(task) && !SECOND.cancel(task) { 0x23 } else { 0xff });
        let mut period = Period::new(task, 5);
        for _ in 0..3 {
            period.wait(task);
            mark(0x24); // every 5 ticks, whatever happens between
            task.delay(2);
        }
        mark(if now(task) == 33 { 0x25 } else { 0xff });
        finish()
    }));
});
