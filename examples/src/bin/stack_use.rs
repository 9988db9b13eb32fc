//! How much of their stacks tasks have used, and whether one has used all of it.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::hint::black_box;

use board::Board;
use board::debug::halt;
use examples::{println, start};
use kernel::{Context, Priority, Stack, Task, TaskHandle};

board::interrupts!(Interrupts: Tick);

static IDLER: Stack<96> = Stack::new();
static WORKER: Stack<128> = Stack::new();
static OVERSEER: Stack<192> = Stack::new();
static ABSENT: Stack<96> = Stack::new();

/// Uses this much of the stack only at times.
#[inline(never)]
fn dig() {
    black_box([0u8; 40]);
}

fn report(task: &mut impl Context, name: &str, of: TaskHandle) {
    match of.unused_stack(task) {
        Some(bytes) => println!("{}: {} bytes were never used, intact: {}", name, bytes, of.is_intact(task)),
        None => println!("{}: not started", name),
    }
}

fn look(task: &mut Task) {
    report(task, "idler", IDLER.task());
    report(task, "worker", WORKER.task());
    report(task, "absent", ABSENT.task());
}

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    start(IDLER.start(boot, Priority::P4, |task| {
        loop {
            task.delay(1);
        }
    }));
    start(WORKER.start(boot, Priority::P5, |task| {
        task.delay(4);
        loop {
            dig();
            task.delay(1);
        }
    }));
    start(OVERSEER.start(boot, Priority::P6, |task| {
        task.delay(3);
        look(task);
        task.delay(3);
        println!("3 ms later:");
        look(task);
        halt()
    }));
});
