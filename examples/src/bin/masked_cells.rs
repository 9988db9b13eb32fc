//! A handler and a task share a masked cell, which is accessible only while interrupts are masked.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::halt;
use examples::{println, start, timer2};
use kernel::{Context, MaskedCell, Priority, Stack, now};

board::interrupts!(Interrupts: Tick);

static TURNS: MaskedCell<u16> = MaskedCell::new(0);
static ODOMETER: Stack<160> = Stack::new();

kernel::interrupt! {
    /// Every 4 ms, in place of a wheel's sensor.
    fn __vector_9(interrupt) {
        interrupt.mask(|masked| TURNS.count(masked)); // costs nothing: interrupts are masked here
    }
}

/// The turns since the last call, from a task or a handler. A turn between the two steps would be lost, so
/// both are in one critical section.
fn take_turns(context: &mut impl Context) -> u16 {
    context.mask(|masked| {
        let turns = TURNS.get(masked);
        TURNS.set(masked, 0);
        turns
    })
}

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    timer2::start();
    start(ODOMETER.start(boot, Priority::P3, |task| {
        for ticks in [10, 30] {
            task.delay(ticks);
            println!("{} ms: {} turns more", now(task), take_turns(task));
        }
        halt()
    }));
});
