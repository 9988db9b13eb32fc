//! The CPU time of each task, by a free-running clock.
//!
//! Each switch charges the time since the last one to the task that ran. An interrupt's time is charged to
//! the task that it preempted, even if it wakes another one, whose time begins at the switch. Nothing is
//! sampled, so a task that the tick wakes is measured like any other.
//!
//! Times are in counts of the clock and wrap after 2^32: 268 s at 16 MHz. Use the difference of two readings.

use crate::arch;
use crate::context::{Context, Interrupt};
use crate::control::TaskHandle;
use crate::control_block::ControlBlock;
use crate::critical::{Masked, MaskedCell};
use crate::{IDLE, ready};

/// The time up to which tasks have been charged. Its low half is the clock's count at that time.
static CHARGED: MaskedCell<u32> = MaskedCell::new(0);

impl ControlBlock {
    fn charge(&self, masked: &Masked, counts: u16) {
        self.cpu_time.set(masked, self.cpu_time.get(masked).wrapping_add(counts.into()));
    }
}

/// Charges the running task. Must be called at least once per turn of the clock.
#[inline(always)]
fn charge(masked: &Masked) {
    let before = CHARGED.get(masked);
    let counts = arch::clock(masked).wrapping_sub(before as u16);
    CHARGED.set(masked, before.wrapping_add(counts.into()));
    ready::running(masked).charge(masked, counts);
}

/// Called by each switch before `running` changes.
pub(crate) extern "C" fn charge_before_switch() {
    // SAFETY: only the switch calls this, with interrupts masked.
    charge(&unsafe { Masked::assume() });
}

/// The handler of the clock's interrupts.
#[doc(hidden)]
pub fn charge_in_turn(interrupt: &mut Interrupt) {
    interrupt.mask(charge);
}

/// How long the CPU was idle, in counts of the clock.
pub fn idle_time(context: &mut impl Context) -> u32 {
    context.mask(|masked| {
        charge(masked);
        IDLE.cpu_time.get(masked)
    })
}

/// How long the clock has run, in its counts: the sum of all tasks' times and the idle time.
pub fn total_time(context: &mut impl Context) -> u32 {
    context.mask(|masked| {
        charge(masked);
        CHARGED.get(masked)
    })
}

impl TaskHandle {
    /// The CPU time of all tasks that have run on this stack, in counts of the clock. On the host, where
    /// tasks take no time, 0.
    pub fn cpu_time(self, context: &mut impl Context) -> u32 {
        context.mask(|masked| {
            charge(masked);
            self.control.cpu_time.get(masked)
        })
    }
}
