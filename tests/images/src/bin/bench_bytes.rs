//! Measured: the sizes of a program's objects, from the symbols of the image. The program does nothing.
#![no_std]
#![no_main]

use core::hint::black_box;

use kernel::{Semaphore, Slot, Stack, Timer};
use tests_images::finish;

/// 100 of its bytes are the stack.
#[unsafe(no_mangle)]
static TASK_WITH_100_BYTES: Stack<100> = Stack::new();

#[unsafe(no_mangle)]
static SEMAPHORE: Semaphore = Semaphore::new(0);

#[unsafe(no_mangle)]
static TIMER: Timer = Timer::new();

/// 16 of its bytes are the message.
#[unsafe(no_mangle)]
static MESSAGE_OF_16_BYTES: Slot<[u8; 16]> = Slot::new();

#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    black_box((&TASK_WITH_100_BYTES, &SEMAPHORE, &TIMER, &MESSAGE_OF_16_BYTES)); // so that they are linked
    finish()
}
