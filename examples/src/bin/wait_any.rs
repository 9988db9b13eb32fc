//! A task waits for several semaphores at once, and learns which of them had the signal.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::halt;
use examples::{println, start};
use kernel::{LONGEST, Priority, Semaphore, Stack, Timer, now};

board::interrupts!(Interrupts: Tick);

static COIN: Semaphore = Semaphore::new(0);
static BUTTON: Semaphore = Semaphore::new(0);
static PATIENCE: Semaphore = Semaphore::new(0);
static TIMER: Timer = Timer::new();
static MACHINE: Stack<192> = Stack::new();
static CUSTOMER: Stack<128> = Stack::new();

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    start(MACHINE.start(boot, Priority::P2, |task| {
        loop {
            TIMER.start(task, 10, &PATIENCE); // restarted at each turn
            match task.wait_any([&COIN, &BUTTON, &PATIENCE]) {
                0 => println!("{} ms: a coin", now(task)),
                1 => println!("{} ms: the button", now(task)),
                _ => {
                    println!("{} ms: nobody there for 10 ms", now(task));
                    halt()
                }
            }
        }
    }));
    start(CUSTOMER.start(boot, Priority::P4, |task| {
        for (pause, signal) in [(2, &COIN), (4, &COIN), (3, &BUTTON)] {
            task.delay(pause);
            signal.post(task);
        }
        loop {
            task.delay(LONGEST);
        }
    }));
});
