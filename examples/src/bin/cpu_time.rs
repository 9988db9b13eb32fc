//! The CPU time of each task, measured at each switch and interrupt, not by samples.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::hint::black_box;

use board::Board;
use board::debug::halt;
use examples::{println, start};
use kernel::{Period, Priority, Stack, idle_time, total_time};

board::interrupts!(Interrupts: Tick, CpuClock);

static CONTROL: Stack<128> = Stack::new();
static WORKER: Stack<96> = Stack::new();
static REPORTER: Stack<192> = Stack::new();

fn work(rounds: u16) {
    for _ in 0..rounds {
        black_box(());
    }
}

/// In microseconds, at 16 clocks each.
fn microseconds(clocks: u32) -> u32 {
    clocks >> 4
}

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    board.cpu_clock.start(Interrupts, boot);
    // Woken by a tick and done before the next: samples taken at ticks would never see it.
    start(CONTROL.start(boot, Priority::P1, |task| {
        let mut period = Period::new(task, 2);
        loop {
            period.wait(task);
            work(1000);
        }
    }));
    start(WORKER.start(boot, Priority::P5, |task| {
        loop {
            work(10_000);
            task.delay(10);
        }
    }));
    start(REPORTER.start(boot, Priority::P0, |task| {
        task.delay(100);
        println!("control: {} us", microseconds(CONTROL.task().cpu_time(task)));
        println!("worker: {} us", microseconds(WORKER.task().cpu_time(task)));
        println!("idle: {} us", microseconds(idle_time(task)));
        println!("in all: {} us", microseconds(total_time(task)));
        halt()
    }));
});
