//! A task that makes single steps starts an external interrupt in one of them.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::mark;
use kernel::{Priority, Semaphore, Stack};
use tests_images::{finish, start};

board::interrupts!(Interrupts: External, Trap);

/// The worker has made its steps, and waits for the button.
const WAITS: u8 = 1;
const PRESSED: u8 = 2;
const WRONG: u8 = 0xff;

static BUTTON: Semaphore = Semaphore::new(0);
static WORKER: Stack<128> = Stack::new();
static DIRECTOR: Stack<192> = Stack::new();

kernel::main!(|boot| {
    let Some(Board { trap, external, .. }) = Board::take(boot) else { return };
    let mut stepper = trap.start(Interrupts);
    start(WORKER.start(boot, Priority::P5, move |task| {
        external.start(Interrupts, task, &BUTTON);
        BUTTON.wait(task);
        mark(PRESSED);
        finish()
    }));
    start(DIRECTOR.start(boot, Priority::P2, move |task| {
        let worker = WORKER.task();
        if worker.suspend(task).is_err() {
            mark(WRONG);
        }
        while stepper.step(task, worker).is_ok() {}
        worker.resume(task);
        mark(WAITS);
    }));
});
