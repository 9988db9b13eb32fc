//! Touches what a target file decides: the widths of integers and pointers, alignment, atomics,
//! start-up code and libgcc for the MCU, code with and without hardware multiplication, initialised
//! data. Nobody runs this image: `./x test` builds it for each target file and for `avr-none`, and
//! compares the two byte by byte.
#![no_std]
#![no_main]

use core::ffi::c_int;
use core::hint::black_box;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU16, Ordering};

#[repr(C)]
struct Sample {
    port: u8,
    value: c_int,
    total: u32,
    weight: f32,
}

static COUNT: AtomicU16 = AtomicU16::new(7);
static WORDS: [&str; 2] = ["master", "slave"];

#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    let sample = black_box(Sample {
        port: 3,
        value: 1000,
        total: 1_000_000,
        weight: 1.5,
    });
    let word = WORDS[usize::from(sample.port)];
    let scaled = sample.total / u32::from(sample.port) * word.len() as u32;
    black_box((
        sample.value.wrapping_mul(sample.value),
        sample.weight * scaled as f32,
        size_of::<Sample>(),
        align_of::<Sample>(),
    ));
    loop {
        COUNT.store(COUNT.load(Ordering::Relaxed) + 1, Ordering::Release);
    }
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    loop {}
}
