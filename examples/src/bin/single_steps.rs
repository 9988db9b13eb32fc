//! A task runs another one by single instructions, and counts how many a round of its loop takes.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::hint::black_box;

use board::Board;
use board::debug::halt;
use examples::{println, start};
use kernel::{Context, MaskedCell, Priority, Stack, Task};

board::interrupts!(Interrupts: Tick, Trap);

static ROUNDS: MaskedCell<u16> = MaskedCell::new(0);

static WORKER: Stack<96> = Stack::new();
static DEBUGGER: Stack<192> = Stack::new();

fn rounds(task: &mut Task) -> u16 {
    task.mask(|masked| ROUNDS.get(masked))
}

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    let mut stepper = board.trap.start(Interrupts);
    start(WORKER.start(boot, Priority::P6, |task| {
        loop {
            task.mask(|masked| ROUNDS.count(masked)); // one step, whatever it does
            black_box(0);
        }
    }));
    start(DEBUGGER.start(boot, Priority::P2, move |task| {
        let worker = WORKER.task();
        println!("to step a task that runs: {}", stepper.step(task, worker).is_ok());
        task.delay(2);
        println!("suspended: {}", worker.suspend(task).is_ok());
        for _ in 0..3 {
            let before = rounds(task);
            let mut steps: u8 = 0;
            while rounds(task) == before && stepper.step(task, worker).is_ok() {
                steps = steps.wrapping_add(1);
            }
            println!("another round after {} steps", steps);
        }
        println!("goes on by itself: {}", worker.resume(task));
        halt()
    }));
});
