//! Swept: calls by which tasks control tasks: suspend, resume, change of priority, end.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::debug::mark;
use kernel::{Never, Priority, Refused, Semaphore, Task, TaskHandle, TaskState};
use tests_images::start;
use tests_images::sweep::{
    self, ASK_EXTERNAL, ASK_TICK, GO_LOW, GO_MIDDLE, GO_TWIN, NOTHING, WRONG, path, stack,
};

board::tick_interrupt!();
board::external_interrupt!(interrupt => {
    sweep::external(interrupt);
    CALL.post(interrupt);
    TWIN.resume(interrupt);
});

static GATE: Semaphore = Semaphore::new(0);
static DONE: Semaphore = Semaphore::new(0);
/// The guest waits for this semaphore, and interrupts post it.
static CALL: Semaphore = Semaphore::new(0);
static NEVER: Semaphore = Semaphore::new(0);

const DIRECTOR: TaskHandle = stack::DIRECTOR.task();
const LOW: TaskHandle = stack::LOW.task();
const RACER: TaskHandle = stack::RACER.task();
const RECEIVER: TaskHandle = stack::RECEIVER.task();
/// Interrupts resume this task, whether it is suspended or not.
const TWIN: TaskHandle = stack::TWIN.task();
const PEER: TaskHandle = stack::PEER.task();
const MIDDLE: TaskHandle = stack::MIDDLE.task();
const GUEST: TaskHandle = stack::GUEST.task();

kernel::main!(|boot| sweep::start_all(boot, director, middle, twin, low));

fn director(task: &mut Task) {
    // The wait of a suspended task ends.
    path(task, 0, |task| {
        GO_MIDDLE.post(task);
        done(MIDDLE.suspend(task));
        GATE.post(task);
        mark(state(task, MIDDLE));
        done(MIDDLE.suspend(task));
        mark(MIDDLE.resume(task).into());
        mark(2);
        NOTHING
    });
    // The wait does not end: the task keeps waiting.
    path(task, 1, |task| {
        GO_MIDDLE.post(task);
        done(MIDDLE.suspend(task));
        mark(MIDDLE.resume(task).into());
        mark(MIDDLE.resume(task).into());
        mark(state(task, MIDDLE));
        GATE.post(task);
        mark(2);
        NOTHING
    });
    // A tick may have come before.
    path(task, 2, |task| {
        GO_MIDDLE.post(task);
        done(MIDDLE.suspend(task));
        task.delay(2);
        mark(state(task, MIDDLE));
        MIDDLE.resume(task);
        DONE.wait(task);
        mark(2);
        NOTHING
    });
    // Suspends tasks that are preempted, and tasks that have become ready at the running task's priority and
    // at a lower one.
    path(task, 3, |task| {
        GO_MIDDLE.post(task);
        mark(5);
        NOTHING
    });
    path(task, 4, |task| {
        GO_MIDDLE.post(task);
        mark(2);
        mark(MIDDLE.resume(task).into());
        mark(4);
        NOTHING
    });
    // The interrupt may come before, or once more.
    path(task, 5, |task| {
        GO_TWIN.post(task);
        mark(ASK_EXTERNAL);
        DONE.wait(task);
        mark(1);
        NOTHING
    });
    path(task, 6, |task| {
        GO_MIDDLE.post(task);
        mark(3);
        DONE.wait(task);
        mark(5);
        NOTHING
    });
    path(task, 7, |task| {
        GO_MIDDLE.post(task);
        done(LOW.set_priority(task, Priority::P6));
        done(TWIN.set_priority(task, Priority::P4));
        mark(4);
        NOTHING
    });
    // Changes priorities of tasks that interrupts wake.
    path(task, 8, |task| {
        done(RACER.set_priority(task, Priority::P3));
        done(RECEIVER.set_priority(task, Priority::P2));
        done(PEER.set_priority(task, Priority::P6));
        mark(ASK_EXTERNAL);
        done(RACER.set_priority(task, Priority::P6));
        done(RECEIVER.set_priority(task, Priority::P5));
        done(PEER.set_priority(task, Priority::P4));
        NOTHING
    });
    // Changes the priority of a task that an interrupt may resume meanwhile.
    path(task, 9, |task| {
        GO_TWIN.post(task);
        done(TWIN.set_priority(task, Priority::P3));
        done(TWIN.set_priority(task, Priority::P4));
        mark(ASK_EXTERNAL);
        DONE.wait(task);
        mark(1);
        NOTHING
    });
    path(task, 10, |task| {
        invite(task, Priority::P5, |task| {
            loop {
                let _ = CALL.wait_timeout(task, 1);
            }
        });
        done(GUEST.kill(task));
        mark(state(task, GUEST));
        invite(task, Priority::P6, |task| {
            loop {
                task.delay(1);
            }
        });
        done(GUEST.kill(task));
        CALL.try_wait(task);
        NOTHING
    });
    // Kills a task in the middle of a wait queue.
    path(task, 11, |task| {
        GO_LOW.post(task);
        invite(task, Priority::P5, |task| {
            GATE.wait(task);
            mark(WRONG);
            task.exit()
        });
        GO_MIDDLE.post(task);
        done(GUEST.kill(task));
        GATE.post(task);
        GATE.post(task);
        mark(3);
        NOTHING
    });
    // Kills a task that has not run yet, and one that is preempted.
    path(task, 12, |task| {
        GO_MIDDLE.post(task);
        mark(2);
        invite(task, Priority::P5, |task| {
            GO_MIDDLE.post(task);
            mark(WRONG);
            task.exit()
        });
        mark(4);
        NOTHING
    });
    path(task, 13, |task| {
        for number in 1..=2 {
            invite(task, Priority::P5, move |task| {
                mark(number);
                task.yield_now();
            });
            mark(state(task, GUEST));
        }
        NOTHING
    });
    // Kills a task that an interrupt may bring to a place where it can't be killed.
    path(task, 14, |task| {
        invite(task, Priority::P5, |task| {
            loop {
                CALL.wait(task);
                task.wait_any([&CALL, &NEVER]);
            }
        });
        while GUEST.kill(task).is_err() {
            CALL.post(task);
        }
        mark(state(task, GUEST));
        NEVER.post(task);
        mark(NEVER.try_wait(task).into());
        CALL.try_wait(task);
        NOTHING
    });
    // A tick wakes the guest while this task runs.
    path(task, 15, |task| {
        invite(task, Priority::P5, |task| {
            task.delay(1);
            DONE.post(task);
        });
        mark(ASK_TICK);
        DONE.wait(task);
        mark(state(task, GUEST));
        NOTHING
    });
}

fn middle(task: &mut Task, path: u8) {
    match path {
        0 | 1 => {
            GATE.wait(task);
            mark(0x10);
        }
        2 => {
            task.delay(1);
            DONE.post(task);
        }
        3 => {
            GO_TWIN.post(task);
            GO_LOW.post(task);
            done(DIRECTOR.suspend(task));
            done(LOW.suspend(task));
            mark(1);
            mark(DIRECTOR.resume(task).into());
            mark(LOW.resume(task).into());
            mark(2);
        }
        4 => {
            mark(0x10);
            done(MIDDLE.suspend(task));
            mark(0x11);
        }
        6 => {
            GO_LOW.post(task);
            mark(0x10);
            done(MIDDLE.set_priority(task, Priority::P7));
            mark(0x11);
            done(MIDDLE.set_priority(task, Priority::P2));
            mark(0x12);
            done(MIDDLE.set_priority(task, Priority::P4));
            DONE.post(task);
        }
        7 => {
            GO_TWIN.post(task);
            GO_LOW.post(task);
            done(LOW.set_priority(task, Priority::P4));
            done(TWIN.set_priority(task, Priority::P5));
            done(DIRECTOR.set_priority(task, Priority::P5));
            done(DIRECTOR.set_priority(task, Priority::P7));
            mark(1);
        }
        11 => {
            GATE.wait(task);
            mark(1);
        }
        12 => match GUEST.state(task) {
            TaskState::NotStarted | TaskState::Killed => {
                invite(task, Priority::P5, |_| {
                    mark(WRONG);
                    sleep()
                });
                done(GUEST.kill(task));
                mark(1);
            }
            _ => {
                done(GUEST.kill(task));
                mark(3);
            }
        },
        _ => {}
    }
}

fn twin(task: &mut Task, path: u8) {
    match path {
        3 => mark(3),
        5 | 9 => {
            done(TWIN.suspend(task));
            DONE.post(task);
        }
        7 => mark(3),
        _ => {}
    }
}

fn low(task: &mut Task, path: u8) {
    match path {
        3 => mark(4),
        6 => mark(2),
        7 => mark(2),
        11 => {
            GATE.wait(task);
            mark(2);
        }
        _ => {}
    }
}

/// Starts the guest, also where one was killed before.
fn invite<R>(task: &mut Task, priority: Priority, body: impl FnOnce(&mut Task) -> R + Send + 'static) {
    // SAFETY: a guest pins nothing on its stack, and lends nothing of it.
    unsafe { GUEST.reuse(task) };
    start(stack::GUEST.start(task, priority, body));
}

fn done(result: Result<(), Refused>) {
    if result.is_err() {
        mark(WRONG);
    }
}

fn state(task: &mut Task, other: TaskHandle) -> u8 {
    0x20 + other.state(task) as u8
}

/// The rest of a body that has nothing to do.
fn sleep() -> Never {
    loop {
        core::hint::spin_loop();
    }
}
