//! Marks for QEMU: characters on USART0, for the feature `qemu`.
//!
//! QEMU has no register that a program may use for marks, and does not show that a program has ended. Its
//! USART sends a character at once, whatever the baud rate, so a mark waits for nothing.

use core::arch::asm;

/// The program sends this at its end.
pub const END: [u8; 2] = [0xff, 0x04];

/// Sends `value`. 6 cycles.
#[inline(always)]
pub fn mark(value: u8) {
    // SAFETY: USART0 has no driver on the MCUs that QEMU has, and sending has no effect on the program.
    unsafe {
        asm!(
            "sts 0xc1, {on}", // 2: UCSR0B
            "sts 0xc6, {value}", // 2: UDR0
            on = in(reg) 1u8 << 3, // TXEN0
            value = in(reg) value,
            options(nomem, nostack, preserves_flags),
        )
    }
}

/// Sends [`END`] and stops the MCU for good.
pub fn halt() -> ! {
    // SAFETY: nothing runs after this.
    unsafe { asm!("cli", options(nomem, nostack)) }
    END.into_iter().for_each(mark);
    loop {
        // SAFETY: interrupts are masked.
        unsafe { asm!("sleep", options(nomem, nostack)) }
    }
}
