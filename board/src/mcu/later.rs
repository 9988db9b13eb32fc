//! What the ATmega328P, the ATmega1284P and the ATmega2560 have in common. Chapters are those of the ATmega328P's
//! datasheet; the others' have the same.

use super::registers::{AC, CPU, EXINT, TC0, TC2};

/// GPIOR0 ("General Purpose I/O Register 0"), which does nothing. There is no OCDR in the ATmega328P.
pub(crate) const MARK: u8 = 0x1e;

/// EICRA: ISC01 and ISC00, a rising edge ("External Interrupts").
const RISING_EDGE: u8 = 0b11;

/// EIFR: INTF0. EIMSK: INT0.
const INT0: u8 = 1 << 0;

pub(crate) fn set_up() {
    // SAFETY: the MCU is set up once, before its devices are handed out.
    let (cpu, comparator) = unsafe { (CPU::steal(), AC::steal()) };
    cpu.smcr().write(|w| w.se().set_bit()); // the mode bits stay 0: idle
    comparator.acsr().write(|w| w.acd().set_bit());
}

/// Interrupts each time that Timer0 has counted 64 clocks `top` + 1 times.
pub(crate) fn start_tick(top: u8) {
    // SAFETY: the tick alone uses Timer0, and starts it once.
    let timer = unsafe { TC0::steal() };
    timer.ocr0a().write(|w| w.set(top));
    timer.timsk0().write(|w| w.ocie0a().set_bit());
    timer.tccr0a().write(|w| w.wgm0().ctc());
    timer.tccr0b().write(|w| w.cs0().prescale_64());
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
    // SAFETY: as above.
    let timer = unsafe { TC2::steal() };
    timer.timsk2().write(|w| w.ocie2a().bit(is_enabled));
}

/// Disables all external interrupts. Returns what their enable bits were.
pub(crate) fn hold_external() -> u8 {
    // SAFETY: called with interrupts masked; what is latched meanwhile strikes later.
    unsafe {
        let external = EXINT::steal();
        let held = external.eimsk().read().bits();
        external.eimsk().write(|w| w.bits(0));
        held
    }
}

/// Undoes [`hold_external`].
pub(crate) fn release_external(held: u8) {
    // SAFETY: called with interrupts masked, with what the register held.
    unsafe { EXINT::steal().eimsk().write(|w| w.bits(held)) };
}

/// Interrupts at each rising edge of INT0. To be called with interrupts masked.
pub(crate) fn start_external() {
    // SAFETY: one driver uses external interrupts, and starts this one once. No value of these registers touches memory.
    unsafe {
        let external = EXINT::steal();
        external.eicra().write(|w| w.bits(RISING_EDGE));
        external.eifr().write(|w| w.bits(INT0)); // an edge from before, or from the change of sense
        external.eimsk().write(|w| w.bits(INT0));
    }
}
