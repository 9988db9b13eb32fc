//! What the chips in `later` have and QEMU does not: a register for marks, Timer0 and external interrupts.
//! Chapters are those of the ATmega328P's datasheet; the others' have the same.

use super::registers::{EXINT, TC0};

/// GPIOR0 ("General Purpose I/O Register 0"), which does nothing. There is no OCDR in the ATmega328P.
pub(crate) const MARK: u8 = 0x1e;

/// EICRA: ISC01 and ISC00, a rising edge ("External Interrupts").
const RISING_EDGE: u8 = 0b11;

/// EIFR: INTF0. EIMSK: INT0.
const INT0: u8 = 1 << 0;

/// Interrupts each time that Timer0 has counted 64 clocks `top` + 1 times.
pub(crate) fn start_tick(top: u8) {
    // SAFETY: the tick alone uses Timer0, and starts it once.
    let timer = unsafe { TC0::steal() };
    timer.ocr0a().write(|w| w.set(top));
    timer.timsk0().write(|w| w.ocie0a().set_bit());
    timer.tccr0a().write(|w| w.wgm0().ctc());
    timer.tccr0b().write(|w| w.cs0().prescale_64());
}

/// Interrupts at each rising edge of INT0. To be called with interrupts masked.
pub(crate) fn start_external() {
    // SAFETY: one driver uses external interrupts, and starts this one once. No value of these registers
    // touches memory.
    unsafe {
        let external = EXINT::steal();
        external.eicra().write(|w| w.bits(RISING_EDGE));
        external.eifr().write(|w| w.bits(INT0)); // an edge from before, or from the change of sense
        external.eimsk().write(|w| w.bits(INT0));
    }
}
