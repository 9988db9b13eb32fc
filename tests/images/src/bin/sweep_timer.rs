//! Swept: timers, delays and periods, and the end of idling by a tick.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::debug::mark;
use kernel::{Period, Semaphore, Task, Timer, now};
use tests_images::sweep::{self, ASK_TICK, FAR, GO_LOW, GO_MIDDLE, GO_TWIN, NOTHING, path};

board::tick_interrupt!();
board::external_interrupt!(interrupt => sweep::external(interrupt));

static FIRST: Timer = Timer::new();
static SECOND: Timer = Timer::new();
static THIRD: Timer = Timer::new();
static DONE: Semaphore = Semaphore::new(0);

kernel::main!(|boot| sweep::start_all(boot, director, middle, errand, errand));

fn director(task: &mut Task) {
    path(task, 0, |task| {
        FIRST.start(task, FAR, &DONE);
        SECOND.start(task, FAR - 3, &DONE);
        FIRST.start(task, FAR - 6, &DONE); // restarted
        THIRD.start(task, FAR, &DONE);
        mark(if SECOND.cancel(task) { 1 } else { 2 });
        mark(if SECOND.cancel(task) { 2 } else { 3 });
        mark(if THIRD.cancel(task) { 4 } else { 5 });
        mark(if FIRST.cancel(task) { 6 } else { 7 });
        NOTHING
    });
    // Behind the timers that are due at the first tick.
    path(task, 1, |task| {
        FIRST.start(task, 3, &DONE);
        SECOND.start(task, 2, &DONE);
        DONE.wait(task);
        DONE.wait(task);
        mark(1);
        NOTHING
    });
    path(task, 2, |task| {
        task.delay(1);
        mark(1);
        task.delay(2);
        mark(2);
        NOTHING
    });
    // A tick may have come before the timer is cancelled; then there is a signal.
    path(task, 3, |task| {
        FIRST.start(task, 1, &DONE);
        mark(1);
        if !FIRST.cancel(task) {
            DONE.wait(task);
        }
        mark(if DONE.try_wait(task) { 2 } else { 3 });
        NOTHING
    });
    // A tick wakes a higher task while this one runs.
    path(task, 4, |task| {
        GO_MIDDLE.post(task);
        mark(ASK_TICK);
        DONE.wait(task);
        mark(1);
        NOTHING
    });
    path(task, 5, |task| {
        let mut period = Period::new(task, 2);
        period.wait(task);
        mark(1);
        period.wait(task);
        mark(if now(task) > 0 && period.missed() == 0 { 2 } else { 3 });
        NOTHING
    });
    // One tick wakes three tasks while the MCU idles.
    path(task, 6, |task| {
        FIRST.start(task, 2, &GO_LOW);
        SECOND.start(task, 2, &GO_TWIN);
        THIRD.start(task, 2, &GO_MIDDLE);
        DONE.wait(task);
        DONE.wait(task);
        DONE.wait(task);
        mark(1);
        NOTHING
    });
    // As path 4, with a timer that is due later.
    path(task, 7, |task| {
        FIRST.start(task, FAR, &DONE);
        GO_MIDDLE.post(task);
        mark(ASK_TICK);
        DONE.wait(task);
        mark(if FIRST.cancel(task) { 1 } else { 2 });
        NOTHING
    });
    // As path 4, with one that is due at the same tick.
    path(task, 8, |task| {
        GO_MIDDLE.post(task);
        FIRST.start(task, 1, &DONE);
        mark(ASK_TICK);
        DONE.wait(task);
        DONE.wait(task);
        mark(1);
        NOTHING
    });
    path(task, 9, |task| {
        let mut period = Period::new(task, 1);
        task.delay(2);
        period.wait(task);
        mark(if period.missed() == 0 { 1 } else { 2 });
        NOTHING
    });
}

fn middle(task: &mut Task, path: u8) {
    if matches!(path, 4 | 7 | 8) {
        task.delay(1);
    }
    DONE.post(task);
}

fn errand(task: &mut Task, _: u8) {
    DONE.post(task);
}
