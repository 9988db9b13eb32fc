//! The kernel's tick, from Timer0.

#[cfg(feature = "atmega128")]
use kernel::{Masked, TICKS, Ticks};

use crate::description::{CLOCK_HZ, TICK_HZ};
use crate::interrupts::Serves;
use crate::mcu;

/// The prescaler of 64 is the smallest with which a period of 1 ms fits 8 bits.
const PRESCALER: u32 = 64;

/// The compare value: one less than the clocks in a tick. 249 makes 1 ms exactly at 16 MHz.
const TOP: u8 = {
    assert!(CLOCK_HZ.is_multiple_of(PRESCALER * TICK_HZ), "the tick is not a whole number of timer clocks");
    let top = CLOCK_HZ / PRESCALER / TICK_HZ - 1;
    assert!(top <= 255, "the tick does not fit 8 bits");
    top as u8
};

/// The present tick, for a vector that does not enter the kernel.
#[cfg(feature = "atmega128")]
#[inline(always)]
pub(crate) fn present(masked: &Masked) -> Ticks {
    TICKS.get(masked)
}

/// The timer that drives the kernel's tick: Timer0.
pub struct Tick(());

impl Tick {
    pub(crate) const fn new() -> Self {
        Tick(())
    }

    /// Starts the tick. For its cost see [`kernel::tick_interrupt!`].
    pub fn start(self, _: impl Serves<Tick>) {
        mcu::start_tick(TOP);
    }
}
