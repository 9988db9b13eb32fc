//! A semaphore counts signals, so that none is lost while no task waits; a wait may time out.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::halt;
use examples::{println, start};
use kernel::{Elapsed, LONGEST, Priority, Semaphore, Stack, now};

board::interrupts!(Interrupts: Tick);

/// A signal for each part on the belt; two lie there at the start.
static PARTS: Semaphore = Semaphore::new(2);
static FITTER: Stack<160> = Stack::new();
static SUPPLIER: Stack<128> = Stack::new();

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    start(FITTER.start(boot, Priority::P2, |task| {
        loop {
            match PARTS.wait_timeout(task, 5) {
                Ok(()) => println!("{} ms: takes a part", now(task)),
                Err(Elapsed) => {
                    println!("{} ms: no part for 5 ms", now(task));
                    halt()
                }
            }
        }
    }));
    start(SUPPLIER.start(boot, Priority::P4, |task| {
        task.delay(3);
        PARTS.post(task); // the fitter is higher: it runs before this is back
        println!("{} ms: has brought one", now(task));
        loop {
            task.delay(LONGEST);
        }
    }));
});
