//! Swept: waits for several semaphores, and jobs.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::debug::mark;
use kernel::{Job, JobContext, Priority, Refused, Semaphore, Task, Timer};
use tests_images::start;
use tests_images::sweep::{
    self, ASK_EXTERNAL, Did, GO_LOW, GO_MIDDLE, GO_TWIN, NOTHING, RACE, STORE, WRONG, path, raced, stack,
};

board::tick_interrupt!();
board::external_interrupt!(interrupt => sweep::external(interrupt));

static FIRST: Semaphore = Semaphore::new(0);
static SECOND: Semaphore = Semaphore::new(0);
static DONE: Semaphore = Semaphore::new(0);
static TIMER: Timer = Timer::new();

static ONE: Job = Job::new(&FIRST, one);
static OTHER: Job = Job::new(&SECOND, other);
/// This job waits ahead of the task that interrupts wake through the same semaphore.
static RUN: Job = Job::new(&RACE, run);
/// This job shows that the task that runs it can't be killed.
static LAST: Job = Job::new(&DONE, kill);

fn one(job: &mut JobContext) {
    mark(0x11);
    SECOND.post(job);
    mark(0x12);
}

fn other(_: &mut JobContext) {
    mark(0x13);
}

fn run(job: &mut JobContext) {
    raced(job);
}

fn kill(job: &mut JobContext) {
    mark(if stack::GUEST.task().kill(job) == Err(Refused::Busy) { 0x14 } else { WRONG });
}

kernel::main!(|boot| sweep::start_all(boot, director, middle, twin, low));

fn director(task: &mut Task) {
    path(task, 0, |task| {
        SECOND.post(task);
        mark(task.wait_any([&FIRST, &SECOND]) as u8);
        NOTHING
    });
    // To a higher task.
    path(task, 1, |task| {
        GO_MIDDLE.post(task);
        SECOND.post(task);
        mark(1);
        NOTHING
    });
    path(task, 2, |task| {
        TIMER.start(task, 1, &SECOND);
        mark(task.wait_any([&FIRST, &SECOND]) as u8);
        NOTHING
    });
    // The second signal stays in store.
    path(task, 3, |task| {
        TIMER.start(task, 1, &GO_MIDDLE);
        let other = if task.wait_any([&FIRST, &SECOND]) == 0 { &SECOND } else { &FIRST };
        mark(other.try_wait(task).into());
        NOTHING
    });
    // Interrupts post one of them.
    path(task, 4, |task| {
        TIMER.start(task, 1, &GO_LOW);
        let mut stored = 0;
        while task.wait_any([&STORE, &DONE]) == 0 {
            stored -= 1;
        }
        Did { stored, ..NOTHING }
    });
    // To a lower task, while others wait for the same semaphores.
    path(task, 5, |task| {
        GO_LOW.post(task);
        GO_TWIN.post(task);
        GO_MIDDLE.post(task);
        mark(4);
        mark(SECOND.try_wait(task).into());
        NOTHING
    });
    // From here on jobs run.
    path(task, 6, |task| {
        let jobs = |task: &mut Task| {
            mark(if task.run_jobs(&[&ONE, &OTHER, &ONE]).is_err() { 0x15 } else { WRONG });
            match task.run_jobs(&[&ONE, &OTHER, &RUN, &LAST]) {
                Ok(never) => never,
                Err(_) => {
                    mark(WRONG);
                    task.exit()
                }
            }
        };
        start(stack::GUEST.start(task, Priority::P5, jobs));
        mark(1);
        SECOND.post(task);
        mark(2);
        FIRST.post(task);
        mark(3);
        NOTHING
    });
    // A higher task wakes the jobs.
    path(task, 7, |task| {
        mark(if task.run_jobs(&[&ONE]).is_err() { 4 } else { WRONG });
        GO_MIDDLE.post(task);
        mark(3);
        NOTHING
    });
    path(task, 8, |task| {
        RACE.post(task);
        mark(ASK_EXTERNAL);
        RACE.post(task);
        DONE.post(task);
        Did { raced: 2, ..NOTHING }
    });
}

fn middle(task: &mut Task, path: u8) {
    match path {
        1 => mark(0x10 + task.wait_any([&FIRST, &SECOND]) as u8),
        3 => {
            SECOND.post(task);
            FIRST.post(task);
        }
        5 => {
            FIRST.post(task);
            SECOND.post(task);
            FIRST.post(task);
            mark(1);
        }
        7 => {
            SECOND.post(task);
            FIRST.post(task);
            SECOND.post(task);
            mark(1);
        }
        _ => {}
    }
}

fn twin(task: &mut Task, path: u8) {
    if path == 5 {
        mark(0x10 + task.wait_any([&SECOND, &FIRST]) as u8);
    }
}

fn low(task: &mut Task, path: u8) {
    match path {
        4 => DONE.post(task),
        5 => mark(0x20 + task.wait_any([&FIRST, &SECOND]) as u8),
        _ => {}
    }
}
