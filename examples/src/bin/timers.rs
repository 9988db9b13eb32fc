//! A timer posts a semaphore once, later; it can be restarted and cancelled.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::halt;
use examples::{println, start};
use kernel::{Priority, Semaphore, Stack, Timer, now};

board::interrupts!(Interrupts: Tick);

static TEA: Timer = Timer::new();
static EGGS: Timer = Timer::new();
static BELL: Semaphore = Semaphore::new(0);
static COOK: Stack<160> = Stack::new();

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    start(COOK.start(boot, Priority::P3, |task| {
        TEA.start(task, 3, &BELL);
        EGGS.start(task, 5, &BELL); // both ring the same bell
        for _ in 0..2 {
            BELL.wait(task);
            println!("{} ms: the bell", now(task));
        }
        TEA.start(task, 3, &BELL);
        TEA.start(task, 7, &BELL); // restarted: it rings once, at 12
        BELL.wait(task);
        println!("{} ms: the bell", now(task));

        EGGS.start(task, 5, &BELL);
        task.delay(4);
        let was_armed = EGGS.cancel(task);
        println!("{} ms: cancelled in time: {}", now(task), was_armed);
        task.delay(4);
        println!("{} ms: rung since: {}", now(task), BELL.try_wait(task));
        halt()
    }));
});
