//! embedded-hal's delays for a task. A delay of a millisecond or more blocks the task, so that others run;
//! only a shorter one is spent in a loop.

use core::arch::asm;

use embedded_hal::delay::DelayNs;
use kernel::{LONGEST, Task, now};

use crate::superbot::{CLOCK_HZ, TICK_HZ};

const _: () = assert!(CLOCK_HZ == 16_000_000 && TICK_HZ == 1_000, "the constants below count on both");

/// The delays of one task.
///
/// ```ignore
/// Delay::new(task).delay_ms(20);
/// ```
pub struct Delay<'a> {
    task: &'a mut Task,
}

impl<'a> Delay<'a> {
    /// Delays for `task`.
    pub fn new(task: &'a mut Task) -> Self {
        Delay { task }
    }

    /// Blocks for at least `milliseconds`, and less than one more.
    fn block(&mut self, mut milliseconds: u32) {
        // The tick that is under way does not count.
        milliseconds = milliseconds.saturating_add(1);
        // Each part begins where the one before was to end, however late the task ran then.
        let mut deadline = now(self.task);
        while milliseconds > 0 {
            let ticks = milliseconds.min(u32::from(LONGEST)) as u16;
            deadline = deadline.wrapping_add(ticks);
            self.task.delay_until(deadline);
            milliseconds -= u32::from(ticks);
        }
    }
}

impl DelayNs for Delay<'_> {
    fn delay_ns(&mut self, ns: u32) {
        if ns < 1_000_000 {
            // Four clocks are 250 ns: 1/256 + 1/8192 is more than 1/250 by less than 1 %.
            spin((ns >> 8) as u16 + (ns >> 13) as u16 + 2);
        } else {
            self.block(divide_rounding_up(ns, 1_000_000));
        }
    }

    fn delay_us(&mut self, us: u32) {
        if us < 1_000 {
            spin(us as u16 * 4 + 1);
        } else {
            self.block(divide_rounding_up(us, 1_000));
        }
    }

    fn delay_ms(&mut self, ms: u32) {
        self.block(ms);
    }
}

/// Keeps the CPU busy for `CYCLES` cycles, rounded down to a multiple of four. Interrupts and a few cycles
/// for the call come on top.
#[inline(always)]
pub fn cycles<const CYCLES: u16>() {
    if CYCLES >= 4 {
        spin(CYCLES / 4);
    }
}

/// Spends four clocks `times` times. `times` must not be 0, which would count as 65,536.
#[inline(always)]
fn spin(times: u16) {
    // SAFETY: counts a register pair down.
    unsafe {
        asm!(
            "0: sbiw {times}, 1", // 2
            "brne 0b",            // 2, and 1 the last time
            times = inout(reg_iw) times => _,
            options(nomem, nostack),
        );
    }
}

/// `amount / unit`, rounded up; bit by bit, as the library's 32-bit division takes 1.3 KB of flash.
fn divide_rounding_up(mut amount: u32, unit: u32) -> u32 {
    let mut quotient = 0u32;
    let mut part = unit << unit.leading_zeros();
    while part >= unit {
        quotient <<= 1;
        if let Some(rest) = amount.checked_sub(part) {
            amount = rest;
            quotient |= 1;
        }
        part >>= 1;
    }
    if amount > 0 { quotient + 1 } else { quotient }
}
