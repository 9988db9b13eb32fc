//! QEMU's replacement for Timer0 and the external interrupts: the 16-bit Timer1. Its compare unit A is the
//! tick. Its compare unit B interrupts half a tick later, each tick, in place of the edge at a pin.
//!
//! A tick takes 64 ms there: QEMU's timers follow the clock of the host, which may stop QEMU for milliseconds
//! while no instruction is executed.

use super::registers::TC1;

/// OCR1A: 64 ms, with a prescaler of 1024 at 16 MHz ("16-bit Timer/Counter1").
const TOP: u16 = 999;

/// TCCR1B: WGM12, the counter restarts at OCR1A, and CS12 and CS10, the prescaler.
const CLEAR_ON_COMPARE: u8 = 1 << 3;
const PRESCALE_1024: u8 = 0b101;

/// TIMSK1.
const OCIE1A: u8 = 1 << 1;
const OCIE1B: u8 = 1 << 2;

/// Interrupts in each round of Timer1. The count for Timer0 does not matter.
pub(crate) fn start_tick(_: u8) {
    start(OCIE1A);
}

/// Interrupts in the middle of each round of Timer1.
pub(crate) fn start_external() {
    start(OCIE1B);
}

fn start(interrupt: u8) {
    // SAFETY: tick and external interrupt share Timer1, with the same settings, and each starts once, before
    // the kernel runs. No value of these registers touches memory.
    unsafe {
        let timer = TC1::steal();
        timer.ocr1a().write(|w| w.bits(TOP));
        timer.ocr1b().write(|w| w.bits(TOP / 2));
        timer.timsk1().modify(|r, w| w.bits(r.bits() | interrupt));
        timer.tccr1b().write(|w| w.bits(CLEAR_ON_COMPARE | PRESCALE_1024));
    }
}

/// The tick's vector: TIMER1_COMPA of the ATmega328P.
#[cfg(feature = "atmega328p")]
#[macro_export]
macro_rules! tick_interrupt {
    () => {
        $crate::kernel::tick_interrupt!(__vector_11);
    };
}

/// Defines what the external interrupt does: TIMER1_COMPB of the ATmega328P.
#[cfg(feature = "atmega328p")]
#[macro_export]
macro_rules! external_interrupt {
    ($interrupt:ident => $body:expr) => {
        $crate::kernel::interrupt! {
            fn __vector_12($interrupt) { $body }
        }
    };
}

/// The tick's vector: TIMER1_COMPA of the ATmega2560.
#[cfg(feature = "atmega2560")]
#[macro_export]
macro_rules! tick_interrupt {
    () => {
        $crate::kernel::tick_interrupt!(__vector_17);
    };
}

/// Defines what the external interrupt does: TIMER1_COMPB of the ATmega2560.
#[cfg(feature = "atmega2560")]
#[macro_export]
macro_rules! external_interrupt {
    ($interrupt:ident => $body:expr) => {
        $crate::kernel::interrupt! {
            fn __vector_18($interrupt) { $body }
        }
    };
}
