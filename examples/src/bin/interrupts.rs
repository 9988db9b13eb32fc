//! A handler wakes a task: the short part of the work is done with interrupts masked, the long one in a task.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::debug::halt;
use core::hint::black_box;
use examples::{println, start, timer2};
use kernel::{Priority, Semaphore, Stack};

static SAMPLE_DUE: Semaphore = Semaphore::new(0);
static SAMPLER: Stack<128> = Stack::new();
static BACKGROUND: Stack<128> = Stack::new();

kernel::interrupt! {
    /// Timer2, every 4 ms. It runs on the kernel's stack, and no other handler interrupts it.
    fn __vector_9(interrupt) {
        SAMPLE_DUE.post(interrupt); // the sampler runs as soon as this handler ends
    }
}

kernel::main!(|boot| {
    start(SAMPLER.start(boot, Priority::P1, |task| {
        for sample in 1..=3 {
            SAMPLE_DUE.wait(task);
            println!("sample {}", sample);
        }
        halt()
    }));
    start(BACKGROUND.start(boot, Priority::P6, |_| {
        println!("the background never blocks");
        loop {
            black_box(0); // interrupted anywhere, and continues unharmed
        }
    }));
    timer2::start();
});
