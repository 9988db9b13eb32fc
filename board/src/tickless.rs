//! The kernel's tick with tickless idle: Timer1, which has 16 bits.

use avr_device::atmega128a::TC1;
use kernel::tickless::{self, TickTimer};
use kernel::{Masked, TICKS, Ticks};

use crate::description::{CLOCK_HZ, TICK_HZ};
use crate::interrupts::Serves;

/// With this prescaler a tick of 1 ms is a whole number of counts, and a turn of the timer takes 262 of them.
const PRESCALER: u32 = 64;

/// TIMSK and TIFR: a match of unit A.
const MATCH_A: u8 = 1 << 4;

/// Timer1, which drives the tick. It also makes the motors' pulses: a program can start only one of the two.
pub enum Timer1 {}

fn timer() -> TC1 {
    // SAFETY: the tick alone uses Timer1, with interrupts masked.
    unsafe { TC1::steal() }
}

impl TickTimer for Timer1 {
    const COUNTS: u16 = {
        assert!(
            CLOCK_HZ.is_multiple_of(PRESCALER * TICK_HZ),
            "the tick is not a whole number of timer clocks"
        );
        let counts = CLOCK_HZ / PRESCALER / TICK_HZ;
        assert!(counts <= 250, "the kernel's most ticks do not fit the timer");
        counts as u16
    };

    #[inline(always)]
    fn counter() -> u16 {
        timer().tcnt1().read().bits()
    }

    #[inline(always)]
    fn set_compare(at: u16) {
        timer().ocr1a().write(|w| w.set(at));
    }

    #[inline(always)]
    fn forget_match() {
        // SAFETY: ones clear flags.
        timer().tifr().write(|w| unsafe { w.bits(MATCH_A) });
    }
}

/// The present tick, for a vector that does not enter the kernel. Such a vector may be the one that has ended
/// a sleep, whose ticks nothing has counted yet. This is a call, for which the vector saves more registers,
/// because the code inlined would be in each of them.
#[inline(never)]
pub(crate) fn present(masked: &Masked) -> Ticks {
    // SAFETY: interrupts are masked, and this is the timer that drives the tick.
    unsafe { tickless::after_sleep::<Timer1>() };
    TICKS.get(masked)
}

/// The timer that drives the kernel's tick.
pub struct Tick(());

impl Tick {
    pub(crate) const fn new() -> Self {
        Tick(())
    }

    /// Starts the tick. It must be called before the kernel runs.
    pub fn start(self, _: impl Serves<Tick>) {
        Timer1::set_compare(Timer1::COUNTS);
        // SAFETY: no value of these registers touches memory.
        unsafe {
            timer().timsk().modify(|r, w| w.bits(r.bits() | MATCH_A));
            timer().tccr1b().write(|w| w.bits(0b011)); // CS11 and CS10: the MCU's clock by 64
        }
    }
}
