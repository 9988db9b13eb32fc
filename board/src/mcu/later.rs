//! What the ATmega328P, the ATmega1284P and the ATmega2560 have in common. Chapters are those of the
//! ATmega328P's datasheet; the others' have the same.

use super::registers::{AC, CPU, EXINT, TC2};

pub(crate) fn set_up() {
    // SAFETY: the MCU is set up once, before its devices are handed out.
    let (cpu, comparator) = unsafe { (CPU::steal(), AC::steal()) };
    cpu.smcr().write(|w| w.se().set_bit()); // the mode bits stay 0: idle
    comparator.acsr().write(|w| w.acd().set_bit());
}

/// Lets Timer2 reach its compare value every second clock.
pub(crate) fn start_timer2() {
    // SAFETY: single steps alone use Timer2, and start it once.
    let timer = unsafe { TC2::steal() };
    timer.ocr2a().write(|w| w.set(1));
    timer.tccr2a().write(|w| w.wgm2().ctc());
    timer.tccr2b().write(|w| w.cs2().direct());
}

/// Enables or disables the interrupt of Timer2.
pub(crate) fn enable_timer2(is_enabled: bool) {
    // SAFETY: single steps alone use Timer2, and call this with interrupts masked.
    let timer = unsafe { TC2::steal() };
    timer.timsk2().write(|w| w.ocie2a().bit(is_enabled));
}

/// Disables all external interrupts. Returns what their enable bits were.
pub(crate) fn hold_external() -> u8 {
    // SAFETY: called with interrupts masked; what is latched meanwhile occurs later.
    unsafe {
        let external = EXINT::steal();
        let held = external.eimsk().read().bits();
        external.eimsk().write(|w| w.bits(0));
        held
    }
}

/// Undoes [`hold_external`]. What was enabled meanwhile stays so.
pub(crate) fn release_external(held: u8) {
    // SAFETY: called with interrupts masked, with what the register held.
    unsafe { EXINT::steal().eimsk().modify(|r, w| w.bits(r.bits() | held)) };
}
