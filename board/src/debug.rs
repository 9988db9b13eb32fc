//! What the on-chip debugger sees, and the simulator with it.

use core::arch::asm;

/// Writes `value` to OCDR, the register through which a program speaks to the on-chip debugger
/// (ATmega128 datasheet, "On-chip Debug Related Register in I/O Memory"). Without one it does nothing.
///
/// 2 cycles. Written as one `out`, so that a simulator times it exactly.
#[inline(always)]
pub fn mark(value: u8) {
    // SAFETY: OCDR has no effect on the MCU.
    unsafe { asm!("out 0x22, {value}", value = in(reg) value, options(nomem, nostack, preserves_flags)) } // 1
}

/// Stops the MCU for good: sleeps with interrupts masked.
pub fn halt() -> ! {
    loop {
        // SAFETY: nothing runs after this.
        unsafe { asm!("cli", "sleep", options(nomem, nostack)) }
    }
}
