//! Stack watermarks: `start` fills the free part of a stack, so that bytes that were ever used show.

use core::ptr;

use crate::arch;
use crate::context::Context;
use crate::control::TaskHandle;

/// The value of bytes that were never used.
pub(crate) const WATERMARK: u8 = 0xa5;

impl TaskHandle {
    /// How many bytes of its stack the task has never used since it was started. `None` if it is not started,
    /// and on the host, where stacks have another size.
    ///
    /// Linear in the result, with interrupts enabled. A used byte that happens to hold the watermark's value
    /// may count as unused if no byte below it was used.
    pub fn unused_stack(self, context: &mut impl Context) -> Option<usize> {
        if !context.mask(|masked| self.control.is_started(masked)) {
            return None;
        }
        let stack = arch::stack(self.control, self.bytes)?;
        Some(stack.take_while(|&address| is_unused(address)).count())
    }

    /// Whether the lowest byte of its stack, the *canary*, is as `start` wrote it. If it is not, the task has
    /// used its stack to the last byte, and has perhaps overwritten what lies below: its own control block,
    /// and then other variables.
    ///
    /// Constant time. Always `true` if the task is not started, and on the host.
    pub fn is_intact(self, context: &mut impl Context) -> bool {
        let is_started = context.mask(|masked| self.control.is_started(masked));
        let stack = arch::stack(self.control, self.bytes).filter(|_| is_started);
        stack.is_none_or(|stack| is_unused(stack.start))
    }
}

/// Whether that byte of a stack holds the watermark.
fn is_unused(address: usize) -> bool {
    // SAFETY: the address is in a stack, which is a static. Its task may write there meanwhile, so the read
    // is volatile.
    unsafe { ptr::with_exposed_provenance::<u8>(address).read_volatile() == WATERMARK }
}
