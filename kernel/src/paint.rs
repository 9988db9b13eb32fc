//! How much of a stack was ever used: `start` paints what is free of it.

use core::ptr;

use crate::arch;
use crate::context::Context;
use crate::handle::TaskHandle;

/// What stands in bytes that were never used.
pub(crate) const PAINT: u8 = 0xa5;

impl TaskHandle {
    /// How many bytes of its stack the task has never used since it was started. `None` where it is not started, and on the
    /// host, where stacks have another size.
    ///
    /// Linear in what it returns, with interrupts enabled. A byte that happens to be used for the paint's own value may count
    /// as unused where nothing below it is used.
    pub fn unused_stack(self, context: &mut impl Context) -> Option<usize> {
        let is_started = context.mask(|masked| self.control.is_started(masked));
        let is_painted = cfg!(target_arch = "avr") && is_started;
        is_painted.then(|| {
            let stack = arch::stack(self.control, self.bytes);
            let mut used = stack.start;
            while used < stack.end && is_unused(used) {
                used += 1;
            }
            used - stack.start
        })
    }

    /// Whether the lowest byte of its stack, the *canary*, is as `start` painted it. Where it is not, the task has used its
    /// stack to the last byte, and perhaps what lies below: its own control block, and then other variables.
    ///
    /// Constant in time. Always `true` where the task is not started, and on the host.
    pub fn is_intact(self, context: &mut impl Context) -> bool {
        let is_started = context.mask(|masked| self.control.is_started(masked));
        !(cfg!(target_arch = "avr") && is_started) || is_unused(arch::stack(self.control, self.bytes).start)
    }
}

/// Whether that byte of a stack holds the paint.
fn is_unused(address: usize) -> bool {
    // SAFETY: part of a stack, a static. Its task may write there meanwhile: volatile, the byte is read as it is.
    unsafe { ptr::with_exposed_provenance::<u8>(address).read_volatile() == PAINT }
}
