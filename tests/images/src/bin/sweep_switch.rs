//! Swept: the start, yields, preemption by interrupts, mutexes.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::hint::black_box;

use board::debug::mark;
use kernel::{Semaphore, Task, Timer};
use tests_images::sweep::{
    self, ASK_EXTERNAL, ASK_TICK, BELOW, Did, GO_LOW, GO_MIDDLE, GO_TWIN, NOTHING, TOTAL, close, path,
};

board::tick_interrupt!();
board::external_interrupt!(interrupt => sweep::external(interrupt));

static TIMER: Timer = Timer::new();
static DONE: Semaphore = Semaphore::new(0);

kernel::main!(|boot| {
    sweep::start_all(boot, director, middle, twin, low);
    sweep::open_at_boot(boot, 0);
});

fn director(task: &mut Task) {
    // The start: each task's first instructions, up to its first wait.
    mark(1);
    close(task, NOTHING);
    path(task, 1, |task| {
        task.yield_now();
        mark(1);
        NOTHING
    });
    path(task, 2, |task| {
        GO_MIDDLE.post(task);
        mark(7);
        NOTHING
    });
    // Preempted, with every register in use.
    path(task, 3, |_| {
        mark(1);
        mark(ASK_EXTERNAL);
        mark(if mixture() == MIXTURE { 2 } else { 3 });
        NOTHING
    });
    path(task, 4, |task| {
        *TOTAL.lock(task) += 3;
        mark(1);
        BELOW.with(task, |below| *below += 5);
        Did { total: 3, below: 5, ..NOTHING }
    });
    // Tasks that would preempt have to wait until the value is free.
    path(task, 5, |task| {
        TOTAL.with(task, |total| {
            let before = black_box(*total);
            mark(ASK_EXTERNAL);
            mark(if mixture() == MIXTURE { 1 } else { 2 });
            *total = before + 1;
        });
        mark(3);
        Did { total: 1, ..NOTHING }
    });
    path(task, 6, |task| {
        BELOW.with(task, |below| {
            let before = black_box(*below);
            mark(ASK_EXTERNAL);
            mark(if mixture() == MIXTURE { 1 } else { 2 });
            *below = before + 1;
        });
        mark(3);
        Did { below: 1, ..NOTHING }
    });
    // A tick preempts this task, and the external interrupt the one that the tick woke.
    path(task, 7, |task| {
        TIMER.start(task, 1, &GO_MIDDLE);
        mark(ASK_TICK);
        DONE.wait(task);
        mark(1);
        NOTHING
    });
    // The same, and the task in the middle blocks while another one is ready.
    path(task, 8, |task| {
        TIMER.start(task, 1, &GO_MIDDLE);
        mark(ASK_TICK);
        DONE.wait(task);
        DONE.wait(task);
        mark(1);
        NOTHING
    });
}

fn middle(task: &mut Task, path: u8) {
    match path {
        2 => {
            GO_TWIN.post(task);
            mark(1);
            task.yield_now();
            mark(3);
            task.yield_now();
            mark(5);
        }
        7 => {
            mark(ASK_EXTERNAL);
            DONE.post(task);
        }
        8 => {
            GO_LOW.post(task);
            DONE.post(task);
        }
        _ => {}
    }
}

fn twin(task: &mut Task, path: u8) {
    if path == 2 {
        mark(2);
        task.yield_now();
        mark(4);
        task.yield_now();
        mark(6);
    }
}

fn low(task: &mut Task, path: u8) {
    if path == 8 {
        DONE.post(task);
    }
}

/// The value of [`mixture`] if no register is lost.
const MIXTURE: u32 = mix([3, 5, 7, 11, 13, 17]);

#[inline(always)]
fn mixture() -> u32 {
    mix(black_box([3, 5, 7, 11, 13, 17]))
}

/// Keeps 24 bytes alive in registers.
#[inline(always)]
const fn mix([mut a, mut b, mut c, mut d, mut e, mut f]: [u32; 6]) -> u32 {
    let mut round = 0;
    while round < 3 {
        a = a.wrapping_add(f);
        b ^= a;
        c = c.wrapping_sub(b);
        d = d.wrapping_add(c ^ e);
        e = e.wrapping_sub(d);
        f ^= e;
        round += 1;
    }
    a ^ b ^ c ^ d ^ e ^ f
}
