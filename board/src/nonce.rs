//! A number that differs from boot to boot, without a clock or a radio: it seeds link epochs and back-off.
//!
//! It lies in SRAM that the start-up code does not initialize, with its complement beside it. A reset keeps
//! both, and the next number follows from the last. At power-up the two hardly ever match, and the number is
//! folded from all the SRAM that the program does not use: most bits come up the same each time, but some of
//! so many do not.

use core::arch::global_asm;
use core::ptr;

/// The distance from each number to the next: odd, so that none returns before all 65,536 were used, and near
/// 65,536 divided by the golden ratio, so that neighbours lie far apart.
const STEP: u16 = 0x9e37;

// In assembly, because a Rust static in this section would be loaded with the image.
global_asm!(r#".section .noinit, "aw", @nobits"#, ".global board_nonce", "board_nonce: .skip 4", ".previous",);

unsafe extern "C" {
    /// The last number and its complement.
    #[link_name = "board_nonce"]
    static mut LAST: [u16; 2];

    /// The end of the program's variables, from the linker.
    static _end: u8;
}

/// The last byte of SRAM (ATmega128 datasheet, "SRAM Data Memory").
const SRAM_END: usize = 0x10ff;

/// The number of this boot. It must be called once, before the tasks run.
pub(crate) fn next() -> u16 {
    let last = &raw mut LAST;
    // SAFETY: nothing else uses `LAST`; volatile, because it holds what was there before the program started.
    let [number, complement] = unsafe { last.read_volatile() };
    let next = if complement == !number { number.wrapping_add(STEP) } else { fold_unused_sram() };
    // SAFETY: this function alone uses `LAST`, and runs once, before the tasks.
    unsafe { last.write_volatile([next, !next]) };
    next
}

/// About 20 cycles a byte, so 5 ms.
fn fold_unused_sram() -> u16 {
    let mut sum = 0u16;
    for address in (&raw const _end).addr()..SRAM_END + 1 {
        // SAFETY: reading SRAM does nothing; volatile, because no value was ever written there.
        let byte = unsafe { ptr::with_exposed_provenance::<u8>(address).read_volatile() };
        sum = sum.rotate_left(1).wrapping_add(u16::from(byte));
    }
    sum
}
