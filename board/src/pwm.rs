//! Pulse-width modulation by the 16-bit timers, behind [`SetDutyCycle`].
//!
//! The timers run in the phase and frequency correct mode, which the datasheet prefers for motors. A duty of
//! 0 is no pulse at all, where the fast mode leaves a spike of one clock. Pulses are symmetrical, so their
//! middle is a quiet moment to measure a motor's current. A new duty starts with a new pulse.

use core::convert::Infallible;
use core::marker::PhantomData;

use avr_device::atmega128a::{PORTB, PORTE, TC1, TC3};
use avr_device::interrupt;
use embedded_hal::pwm::{ErrorType, SetDutyCycle};
use tasks::superbot::{CLOCK_HZ, PWM_HZ};

/// The timer counts up to here and down again, once a period: 400 steps of duty at 16 MHz and 20 kHz.
pub(crate) const TOP: u16 = {
    let top = CLOCK_HZ / PWM_HZ / 2;
    assert!(top >= 3 && top <= 0xffff, "PWM_HZ does not fit ICR");
    top as u16
};

/// TCCRnB: phase and frequency correct up to ICRn.
const MODE: u8 = 1 << 4; // WGMn3
/// TCCRnB: the timer counts the MCU's clock.
const CLOCK: u8 = 1 << 0; // CSn0

/// A timer's compare unit and its pin, named by its type.
pub trait Compare {
    /// Starts the timer, and gives the pin to the compare unit.
    #[doc(hidden)]
    fn connect();

    #[doc(hidden)]
    fn set(value: u16);
}

/// The output of the compare unit `C`, not started.
pub struct Output<C> {
    compare: PhantomData<C>,
}

/// The running output of the compare unit `C`.
pub struct Pwm<C> {
    compare: PhantomData<C>,
}

impl<C: Compare> Output<C> {
    pub(crate) const fn new() -> Self {
        Output { compare: PhantomData }
    }

    /// Drives the pin: low, until a duty is set.
    pub fn start(self) -> Pwm<C> {
        C::connect();
        Pwm { compare: PhantomData }
    }
}

impl<C> ErrorType for Pwm<C> {
    type Error = Infallible;
}

impl<C: Compare> SetDutyCycle for Pwm<C> {
    fn max_duty_cycle(&self) -> u16 {
        TOP
    }

    /// A `duty` above [`max_duty_cycle`](Self::max_duty_cycle) counts as that.
    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        C::set(duty.min(TOP));
        Ok(())
    }
}

macro_rules! compare {
    ($(#[$attribute:meta])* $Compare:ident: $timer:ident, $mode_a:ident.$match:ident, $mode_b:ident, $top:ident,
     $compare:ident, $port:ident.$direction:ident.$pin:ident) => {
        $(#[$attribute])*
        pub enum $Compare {}

        impl Compare for $Compare {
            fn connect() {
                // SAFETY: all code that shares these registers changes them with interrupts masked.
                let (timer, port) = unsafe { ($timer::steal(), $port::steal()) };
                interrupt::free(|_| {
                    // The mode first: in other modes ICRn takes no value (ATmega128 datasheet, "Input Capture
                    // Register"). The clock last, unless another unit has started it.
                    // SAFETY: a mode of the timer that touches no memory.
                    timer.$mode_b().modify(|r, w| unsafe { w.bits(r.bits() | MODE) });
                    timer.$top().write(|w| w.set(TOP));
                    timer.$mode_a().modify(|_, w| w.$match().match_clear());
                    // SAFETY: a mode of the timer that touches no memory.
                    timer.$mode_b().write(|w| unsafe { w.bits(MODE | CLOCK) });
                    port.$direction().modify(|_, w| w.$pin().set_bit());
                });
            }

            fn set(value: u16) {
                // SAFETY: only the owner of this unit writes the compare register, with interrupts masked
                // below.
                let timer = unsafe { $timer::steal() };
                // Masked: the accesses to the timer's 16-bit registers share a byte (ATmega128 datasheet,
                // "Accessing 16-bit Registers").
                interrupt::free(|_| timer.$compare().write(|w| w.set(value)));
            }
        }
    };
}

compare!(
    /// OC1A = PB5.
    Timer1A: TC1, tccr1a.com1a, tccr1b, icr1, ocr1a, PORTB.ddrb.pb5
);
compare!(
    /// OC1B = PB6.
    Timer1B: TC1, tccr1a.com1b, tccr1b, icr1, ocr1b, PORTB.ddrb.pb6
);
compare!(
    /// OC1C = PB7.
    Timer1C: TC1, tccr1a.com1c, tccr1b, icr1, ocr1c, PORTB.ddrb.pb7
);
compare!(
    /// OC3A = PE3.
    Timer3A: TC3, tccr3a.com3a, tccr3b, icr3, ocr3a, PORTE.ddre.pe3
);
compare!(
    /// OC3B = PE4.
    Timer3B: TC3, tccr3a.com3b, tccr3b, icr3, ocr3b, PORTE.ddre.pe4
);
compare!(
    /// OC3C = PE5.
    Timer3C: TC3, tccr3a.com3c, tccr3b, icr3, ocr3c, PORTE.ddre.pe5
);
