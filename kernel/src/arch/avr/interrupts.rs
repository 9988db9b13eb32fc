//! Masking of interrupts.

use core::arch::asm;

use crate::critical::Masked;

/// `cli`: 1 cycle.
#[inline(always)]
pub(crate) fn disable_interrupts() {
    // SAFETY: masking interrupts breaks no invariant; as a compiler barrier it keeps what follows behind it.
    unsafe { asm!("cli", options(nostack)) }
}

/// `sei`: 1 cycle; the instruction after it still runs before any interrupt.
#[inline(always)]
pub(crate) fn enable_interrupts() {
    // SAFETY: only `Task::mask` calls this, after it has disabled interrupts. Tasks run with interrupts
    // enabled.
    unsafe { asm!("sei", options(nostack)) }
}

/// After `sei` the CPU runs one more instruction before it takes an interrupt. If that instruction is the
/// `cli` of the next critical section, no interrupt occurs between the two; after this `nop` one can. 1
/// cycle.
#[inline(always)]
pub(crate) fn irq_window() {
    // SAFETY: no effect.
    unsafe { asm!("nop", options(nostack)) }
}

/// 3 cycles if no interrupt is pending.
///
/// # Safety
/// Only in an ISR, between two of its critical sections. The ISR must tolerate that others nest on its stack.
#[inline(always)]
pub(crate) unsafe fn isr_window() {
    // SAFETY: the caller guarantees that this is an ISR between two critical sections, where others may nest.
    unsafe {
        asm!(
            "sei", // 1: takes effect after the next instruction
            "nop", // 1
            "cli", // 1
            options(nostack),
        )
    }
}

/// Runs `body` with interrupts masked, and leaves them as they were. 3 cycles.
#[inline(always)]
pub(crate) fn critical<R>(body: impl FnOnce(&Masked) -> R) -> R {
    let status: u8;
    // SAFETY: reads SREG and masks interrupts.
    unsafe {
        asm!(
            "in {status}, 0x3f", // 1: SREG, with I as it was
            "cli",               // 1
            status = out(reg) status,
            options(nostack),
        );
    }
    // SAFETY: interrupts were just masked, and are restored only after `body`.
    let result = body(&unsafe { Masked::assume() });
    // SAFETY: restores SREG.
    unsafe { asm!("out 0x3f, {status}", status = in(reg) status, options(nostack)) } // 1
    result
}
