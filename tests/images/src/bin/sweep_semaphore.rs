//! Swept: semaphores and event flags, to no task and to higher, lower and equal tasks, with and without a
//! wait.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::debug::mark;
use kernel::{EventFlags, Semaphore, Task};
use tests_images::sweep::{self, Did, FLAGS, GO_LOW, GO_MIDDLE, GO_TWIN, NOTHING, RACE, SIGNS, STORE, path};

board::tick_interrupt!();
board::external_interrupt!(interrupt => sweep::external(interrupt));

static GATE: Semaphore = Semaphore::new(0);
static LAMPS: EventFlags = EventFlags::new();

kernel::main!(|boot| sweep::start_all(boot, director, middle, twin, low));

fn director(task: &mut Task) {
    path(task, 0, |task| {
        STORE.post(task);
        STORE.post(task);
        Did { stored: 2, ..NOTHING }
    });
    path(task, 1, |task| {
        STORE.post(task);
        STORE.wait(task);
        let taken = STORE.try_wait(task);
        Did { stored: -i16::from(taken), ..NOTHING }
    });
    // To a higher task, which blocks again and so switches to this one, which gave up the CPU by its own
    // call.
    path(task, 2, |task| {
        mark(1);
        GO_MIDDLE.post(task);
        mark(3);
        NOTHING
    });
    // From the higher task to a lower one, which is ready when the higher one blocks.
    path(task, 3, |task| {
        GO_MIDDLE.post(task);
        mark(4);
        NOTHING
    });
    // Three wait at one semaphore: they are woken by priority, and by arrival among equals.
    path(task, 4, |task| {
        GO_LOW.post(task);
        GO_MIDDLE.post(task);
        GO_TWIN.post(task);
        GATE.post(task);
        GATE.post(task);
        GATE.post(task);
        mark(4);
        NOTHING
    });
    path(task, 5, |task| {
        RACE.post(task);
        RACE.post(task);
        RACE.post(task);
        Did { raced: 3, ..NOTHING }
    });
    path(task, 6, |task| {
        GO_MIDDLE.post(task);
        Did { raced: 3, ..NOTHING }
    });
    // Several tasks become ready, at two priorities, before the task that woke them blocks.
    path(task, 7, |task| {
        GO_MIDDLE.post(task);
        mark(5);
        NOTHING
    });
    path(task, 8, |task| {
        GO_MIDDLE.post(task);
        GO_TWIN.post(task);
        mark(1);
        LAMPS.set(task, 1);
        mark(3);
        LAMPS.set(task, 2);
        mark(5);
        NOTHING
    });
    path(task, 9, |task| {
        FLAGS.set(task, 2);
        FLAGS.set(task, 4);
        FLAGS.take(task, 8);
        SIGNS.set(task, 2);
        SIGNS.take(task, 2);
        Did { flags: 6, ..NOTHING }
    });
    // Waits with a timeout: the signal is in store, comes, or does not come.
    path(task, 10, |task| {
        GATE.post(task);
        mark(if GATE.wait_timeout(task, 5).is_ok() { 1 } else { 2 });
        GO_LOW.post(task);
        GATE.post(task);
        mark(4);
        mark(if GATE.wait_timeout(task, 1).is_ok() { 5 } else { 6 });
        NOTHING
    });
    // By `post_in_loop`: to a higher task, and to a lower one.
    path(task, 11, |task| {
        mark(1);
        GO_MIDDLE.post_in_loop(task);
        mark(3);
        GO_LOW.post_in_loop(task);
        mark(4);
        NOTHING
    });
}

fn middle(task: &mut Task, path: u8) {
    match path {
        2 | 11 => mark(2),
        3 => {
            mark(1);
            GO_LOW.post(task);
            mark(2);
        }
        4 => {
            GATE.wait(task);
            mark(1);
        }
        6 => {
            RACE.post(task);
            RACE.post(task);
            RACE.post(task);
        }
        7 => {
            GO_LOW.post(task);
            mark(1);
            GO_TWIN.post(task);
            mark(2);
        }
        8 => mark(2 + LAMPS.wait_any(task, 1 | 4) - 1),
        _ => {}
    }
}

fn twin(task: &mut Task, path: u8) {
    match path {
        4 => {
            GATE.wait(task);
            mark(2);
        }
        7 => mark(3),
        8 => {
            LAMPS.wait_all(task, 2);
            mark(4);
        }
        _ => {}
    }
}

fn low(task: &mut Task, path: u8) {
    match path {
        3 => mark(3),
        4 => {
            GATE.wait(task);
            mark(3);
        }
        7 => mark(4),
        11 => mark(5),
        10 => mark(if GATE.wait_timeout(task, 1000).is_ok() { 3 } else { 7 }),
        _ => {}
    }
}
