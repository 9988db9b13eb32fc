//! A task uses more and more of its stack, in the end more than it has. At each tick another task counts the
//! unused bytes, and detects the overrun.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::hint::black_box;
use core::mem::MaybeUninit;

use board::Board;
use board::debug::mark;
use kernel::{Priority, Stack, Task};
use tests_images::{finish, start};

board::interrupts!(Interrupts: Tick);

/// The mark of a stack that is not intact.
const OVERRUN: u8 = 0xfe;

/// 2 bytes less than the task needs: a larger overrun would keep the watcher from running.
static DEEP: Stack<{ if cfg!(target_feature = "eijmpcall") { 79 } else { 75 } }> = Stack::new();
static WATCHER: Stack<128> = Stack::new();
static NEVER: Stack<64> = Stack::new();

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    start(DEEP.start(boot, Priority::P5, |task| {
        work(task, 2);
        deep(task);
        deeper(task);
        finish()
    }));
    start(WATCHER.start(boot, Priority::P0, |task| {
        mark(if NEVER.task().unused_stack(task).is_none() { 0 } else { 0xff });
        loop {
            for watched in [&DEEP.task(), &WATCHER.task()] {
                mark(watched.unused_stack(task).map_or(0xff, |bytes| bytes as u8));
            }
            if !DEEP.task().is_intact(task) {
                mark(OVERRUN);
                finish()
            }
            task.delay(1);
        }
    }));
});

#[inline(never)]
fn deep(task: &mut Task) {
    let bytes = [MaybeUninit::<u8>::uninit(); 10];
    black_box(&bytes);
    work(task, 3);
    black_box(&bytes);
}

#[inline(never)]
fn deeper(task: &mut Task) {
    let bytes = [MaybeUninit::<u8>::uninit(); 30];
    black_box(&bytes);
    work(task, 10);
    black_box(&bytes);
}

/// Works for so many ticks.
#[inline(never)]
fn work(task: &mut Task, ticks: u16) {
    let begun = kernel::now(task);
    while kernel::now(task).wrapping_sub(begun) < ticks {}
}
