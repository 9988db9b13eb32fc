//! A task can suspend, resume and end another one, and start a new one on the same stack.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::halt;
use examples::{println, start};
use kernel::{Never, Priority, Stack, Task, now};

board::interrupts!(Interrupts: Tick);

static BLINKER: Stack<128> = Stack::new();
static OPERATOR: Stack<160> = Stack::new();

fn blink(task: &mut Task) -> Never {
    loop {
        println!("{} ms: blink", now(task));
        task.delay(2);
    }
}

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    start(BLINKER.start(boot, Priority::P4, blink));
    start(OPERATOR.start(boot, Priority::P2, |task| {
        let blinker = BLINKER.task();
        task.delay(3);
        println!("{} ms: suspended: {}", now(task), blinker.suspend(task).is_ok());
        task.delay(4); // the blinker's own delay ends meanwhile
        println!("{} ms: resumed: {}", now(task), blinker.resume(task));
        task.delay(3);
        println!("{} ms: killed: {}", now(task), blinker.kill(task).is_ok());
        task.delay(4);
        // SAFETY: the blinker has pinned nothing on its stack, and lent nothing of it.
        println!("{} ms: its stack is free: {}", now(task), unsafe { blinker.reuse(task) });
        start(BLINKER.start(task, Priority::P4, |task: &mut Task| {
            println!("{} ms: one last blink", now(task)); // a body that returns ends its task
        }));
        task.delay(1);
        println!("{} ms: to be killed: {}", now(task), blinker.kill(task).is_ok());
        halt()
    }));
});
