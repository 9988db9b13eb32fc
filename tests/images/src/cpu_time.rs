//! Tasks that take turns for a second, and then the kernel's times of each.
//!
//! Marks: 1 when the clock has started; 2 when the times are in `REPORT`.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::hint::black_box;

use board::Board;
use board::debug::mark;
use kernel::{Context, MaskedCell, Period, Priority, Stack, Task};
use tests_images::{finish, start};

board::interrupts!(Interrupts: Tick, CpuClock);

static REPORTER: Stack<160> = Stack::new();
static CONTROL: Stack<128> = Stack::new();
static WORKERS: [Stack<128>; 2] = [const { Stack::new() }; 2];

/// The times of the control task, the workers, the idle task and the reporter, and the total.
#[unsafe(no_mangle)]
static REPORT: MaskedCell<[u32; 6]> = MaskedCell::new([0; 6]);

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    board.cpu_clock.start(Interrupts, boot);
    mark(1);
    start(REPORTER.start(boot, Priority::P0, |task| {
        task.delay(1000);
        report(task);
        mark(2);
        finish()
    }));
    // The tick wakes this task, and it is done long before the next tick: sampling at ticks never sees
    // it.
    start(CONTROL.start(boot, Priority::P1, |task| {
        task.delay(50); // first the workers have the CPU for longer than a period of the clock
        let mut period = Period::new(task, 2);
        loop {
            period.wait(task);
            work(200);
        }
    }));
    for (stack, (turns, rest)) in WORKERS.iter().zip([(20, 300), (3, 170)]) {
        start(stack.start(boot, Priority::P4, move |task| {
            loop {
                for _ in 0..turns {
                    work(10_000);
                    task.yield_now();
                }
                task.delay(rest); // longer than a period of the clock
            }
        }));
    }
});

/// About 5 cycles a round.
#[inline(never)]
fn work(rounds: u16) {
    for _ in 0..rounds {
        black_box(());
    }
}

fn report(task: &mut Task) {
    let [one, other] = &WORKERS;
    let idle = kernel::idle_time(task);
    let [control, one, other] =
        [&CONTROL.task(), &one.task(), &other.task()].map(|handle| handle.cpu_time(task));
    // Last, because the reporter itself runs.
    let reporter = REPORTER.task().cpu_time(task);
    let total = kernel::total_time(task);
    task.mask(|masked| REPORT.set(masked, [control, one, other, idle, reporter, total]));
}
