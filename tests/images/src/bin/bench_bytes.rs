//! Measured: the size of what a program declares, from the symbols of the image. It does nothing.
#![no_std]
#![no_main]

use kernel::{Semaphore, Slot, Stack, Timer};
use tests_images::finish;

/// 100 bytes are the stack's.
#[used]
#[unsafe(no_mangle)]
static TASK_WITH_100_BYTES: Stack<100> = Stack::new();

#[used]
#[unsafe(no_mangle)]
static SEMAPHORE: Semaphore = Semaphore::new(0);

#[used]
#[unsafe(no_mangle)]
static TIMER: Timer = Timer::new();

/// 16 bytes are the message's.
#[used]
#[unsafe(no_mangle)]
static MESSAGE_OF_16_BYTES: Slot<[u8; 16]> = Slot::new();

#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    finish()
}
