//! The watchdog (ATmega128 datasheet, "Watchdog Timer"): it resets the MCU when it is not fed in time.
//!
//! It counts the clocks of its own oscillator of about 1 MHz: the time depends on supply and temperature. The
//! datasheet has typical times only; those given here are for 5 V. After any reset the watchdog is off.

use core::arch::asm;

use kernel::Context;

/// How long the watchdog waits: the three bits WDP.
#[derive(Clone, Copy)]
#[repr(u8)]
pub(crate) enum Patience {
    /// 16,384 clocks, 14 ms.
    Shortest = 0,
    /// 131,072 clocks, 0.11 s.
    Tenth = 3,
}

/// The watchdog, not started.
pub struct Watchdog(());

/// Feeds the watchdog.
pub struct Feeder(());

impl Watchdog {
    pub(crate) const fn new() -> Self {
        Watchdog(())
    }

    /// Starts the watchdog: from now on it has to be fed every 0.11 s.
    pub fn start(self, context: &mut impl Context) -> Feeder {
        // SAFETY: interrupts are masked.
        context.mask(|_| unsafe { start(Patience::Tenth) });
        Feeder(())
    }
}

impl Feeder {
    /// Restarts the watchdog's wait.
    #[inline(always)]
    pub fn feed(&mut self) {
        // SAFETY: the watchdog touches no memory.
        unsafe { asm!("wdr", options(nomem, nostack, preserves_flags)) }
    }
}

/// Starts the watchdog, or restarts it with another patience.
///
/// # Safety
/// Interrupts must be masked: a new patience counts only within four cycles of WDCE (datasheet, "Timed
/// Sequences for Changing the Configuration of the Watchdog Timer").
pub(crate) unsafe fn start(patience: Patience) {
    const WDCE: u8 = 1 << 4;
    const WDE: u8 = 1 << 3;
    // SAFETY: the watchdog touches no memory.
    unsafe {
        asm!(
            "wdr",
            "out 0x21, {change}", // WDTCR
            "out 0x21, {enable}",
            change = in(reg) WDCE | WDE,
            enable = in(reg) WDE | patience as u8,
            options(nomem, nostack, preserves_flags)
        );
    }
}
