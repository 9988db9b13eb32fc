//! Marks for the on-chip debugger and the simulator.

use core::arch::asm;

use crate::mcu::MARK;

/// Writes `value` to the MCU's register for marks: OCDR on the ATmega128, GPIOR0 on the others.
///
/// 2 cycles. Written as one `out`, so that a simulator times it exactly.
#[inline(always)]
pub fn mark(value: u8) {
    // SAFETY: the register has no effect on the MCU.
    unsafe {
        asm!(
            "out {MARK}, {value}", // 1
            MARK = const MARK,
            value = in(reg) value,
            options(nomem, nostack, preserves_flags),
        )
    }
}

/// Stops the MCU for good: sleeps with interrupts masked.
pub fn halt() -> ! {
    loop {
        // SAFETY: nothing runs after this.
        unsafe { asm!("cli", "sleep", options(nomem, nostack)) }
    }
}
