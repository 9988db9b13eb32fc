//! How long each task has had the CPU, by a clock that runs freely.
//!
//! Each switch charges what has passed since the last one to the task that ran. An interrupt's time is
//! charged to the task that it preempted, also where it wakes another one: that one's time begins at the
//! switch. Nothing is sampled, so a task that the tick wakes is counted like any other.
//!
//! Times are counted in the clock's counts and wrap after 2^32: 268 s at 16 MHz. What counts is the
//! difference of two readings.

use crate::arch;
use crate::context::{Context, Interrupt};
use crate::control::TaskHandle;
use crate::control_block::ControlBlock;
use crate::critical::{Masked, MaskedCell};
use crate::{IDLE, ready};

/// Until when the time is charged. Its low half is what the clock said then.
static CHARGED: MaskedCell<u32> = MaskedCell::new(0);

impl ControlBlock {
    fn charge(&self, masked: &Masked, counts: u16) {
        self.cpu_time.set(masked, self.cpu_time.get(masked).wrapping_add(counts.into()));
    }
}

/// Charges the running task. To be called within one turn of the clock, at least.
#[inline(always)]
fn charge(masked: &Masked) {
    let before = CHARGED.get(masked);
    let counts = arch::clock(masked).wrapping_sub(before as u16);
    CHARGED.set(masked, before.wrapping_add(counts.into()));
    ready::running(masked).charge(masked, counts);
}

/// What a switch does before another task is the running one.
pub(crate) extern "C" fn charge_before_switch() {
    // SAFETY: only the switch calls this, with interrupts masked.
    charge(&unsafe { Masked::assume() });
}

/// What the clock's interrupts do.
#[doc(hidden)]
pub fn charge_in_turn(interrupt: &mut Interrupt) {
    interrupt.mask(charge);
}

/// How long no task had the CPU.
pub fn idle_time(context: &mut impl Context) -> u32 {
    context.mask(|masked| {
        charge(masked);
        IDLE.cpu_time.get(masked)
    })
}

/// How long the clock has run: what all tasks and the idle time make together.
pub fn total_time(context: &mut impl Context) -> u32 {
    context.mask(|masked| {
        charge(masked);
        CHARGED.get(masked)
    })
}

impl TaskHandle {
    /// How long whatever ran on this stack has had the CPU. On the host, where tasks take no time, 0.
    pub fn cpu_time(self, context: &mut impl Context) -> u32 {
        context.mask(|masked| {
            charge(masked);
            self.control.cpu_time.get(masked)
        })
    }
}
