//! Sleep, for a program that waits for interrupts by itself. Other programs leave that to the kernel's idle
//! task.

use core::arch::asm;

use kernel::{Context, Interrupt, Task};

/// Sleeps until an interrupt has been served, unless `has_work` returns that there is something to do.
/// Interrupts are masked while it runs, so that none occurs between its check and the sleep.
///
/// # Safety
/// `has_work` must make no task ready: no switch follows that call, and until one does the kernel takes the
/// head for the running task.
#[inline(always)]
pub unsafe fn sleep_unless(task: &mut Task, has_work: impl FnOnce(&mut Interrupt) -> bool) {
    task.mask(|_| {
        // SAFETY: interrupts are masked as in a handler, and this context is gone before they are enabled.
        // The caller guarantees that it makes no switch due.
        let has_work = has_work(&mut unsafe { Interrupt::assume() });
        if !has_work {
            // SAFETY: interrupts are masked again at the end. `sei` takes effect after the next instruction,
            // so the interrupt that ends the sleep occurs after it began. Handlers restore all registers.
            unsafe { asm!("sei", "sleep", "cli") };
        }
    });
}
