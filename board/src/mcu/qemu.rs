//! What QEMU has in place of Timer0 and the external interrupts: the 16-bit Timer1. Its compare unit A is the
//! tick. Its compare unit B interrupts half a tick later, each tick, in place of the edge at a pin.

use super::registers::TC1;

/// TCCR1B: WGM12, the counter begins anew at OCR1A, and CS11 and CS10, a prescaler of 64 ("16-bit
/// Timer/Counter1").
const CLEAR_ON_COMPARE: u8 = 1 << 3;
const PRESCALE_64: u8 = 0b11;

/// TIMSK1.
const OCIE1A: u8 = 1 << 1;
const OCIE1B: u8 = 1 << 2;

/// What Timer1 counts to if there is no tick: 1 ms at 16 MHz.
const TOP: u8 = 249;

/// Interrupts each time that Timer1 has counted 64 clocks `top` + 1 times.
pub(crate) fn start_tick(top: u8) {
    start(top, OCIE1A);
}

/// Interrupts once in each round of Timer1.
pub(crate) fn start_external() {
    start(TOP, OCIE1B);
}

fn start(top: u8, interrupt: u8) {
    // SAFETY: tick and external interrupt share Timer1, with the same settings, and each starts once, before
    // the kernel runs. No value of these registers touches memory.
    unsafe {
        let timer = TC1::steal();
        timer.ocr1a().write(|w| w.bits(top.into()));
        timer.ocr1b().write(|w| w.bits(u16::from(top / 2)));
        timer.timsk1().modify(|r, w| w.bits(r.bits() | interrupt));
        timer.tccr1b().write(|w| w.bits(CLEAR_ON_COMPARE | PRESCALE_64));
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
