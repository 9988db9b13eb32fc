//! Marks around a measured stretch of a program.
//!
//! Each mark is one piece of assembly that takes 2 cycles wherever it stands. The compiler moves no memory
//! access past it.

use core::arch::asm;

/// The bit that the mark at the end of a stretch has set besides the stretch's number.
const END: u8 = 0x80;

/// Marks the beginning of the stretch of this number, 1 to 0x5f.
#[inline(always)]
pub fn begin<const STRETCH: u8>() {
    exact_mark!(STRETCH);
}

/// Marks the end of the stretch of this number.
#[inline(always)]
pub fn end<const STRETCH: u8>() {
    exact_mark!(END | STRETCH);
}

/// Keeps the CPU busy for 100,000 cycles, with no register alive.
#[inline(never)]
pub fn busy() {
    for round in 0..20_000u16 {
        core::hint::black_box(round);
    }
}

macro_rules! exact_mark {
    ($value:expr) => {
        // SAFETY: OCDR (ATmega128 datasheet, "On-chip Debug Related Register in I/O Memory") has no effect on
        // the MCU.
        unsafe {
            asm!(
                "ldi {scratch}, {value}", // 1
                "out 0x22, {scratch}",    // 1
                value = const $value,
                scratch = out(reg_upper) _,
                options(nostack, preserves_flags),
            )
        }
    };
}
use exact_mark;
