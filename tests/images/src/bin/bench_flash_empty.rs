//! An image without a kernel: the vectors, the start-up code, an end.
#![no_std]
#![no_main]

use tests_images::finish;

#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    finish()
}
