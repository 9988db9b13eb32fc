//! The stack check of the feature `stack-check`: each switch checks whether the task that ran has overflowed
//! its stack.
//!
//! A control block lies directly below its stack, so its address tells where the stack ends. The check sees
//! the stack pointer at the switch only, not what a function used and released before that:
//! [`TaskHandle::is_intact`](crate::TaskHandle::is_intact) shows that.
//!
//! A kernel call that overflows the stack by several bytes may overwrite the control block before the switch
//! checks it, and misbehave because of that.

use core::ptr;

use super::IDLE_CONTEXT;
use crate::control_block::ControlBlock;
use crate::critical::Masked;
use crate::ready;

unsafe extern "C" {
    /// The program's handler of an overflow: see [`stack_overflow!`](crate::stack_overflow!).
    safe fn kernel_stack_overflow(stack: usize) -> !;
}

impl ControlBlock {
    /// Whether the saved context reaches below the stack.
    fn has_overflowed(&self, masked: &Masked) -> bool {
        let stack_pointer = self.stack_pointer.get(masked);
        // A preempted context's stack pointer is the address of its lowest byte, a voluntary one's that of
        // the free byte below. `lowest` is 0 for the idle task, and 1 for a task that has ended.
        let is_preempted = stack_pointer & IDLE_CONTEXT != 0;
        let lowest = if is_preempted { stack_pointer & !IDLE_CONTEXT } else { stack_pointer + 1 };
        let bottom = ptr::from_ref(self).addr() + size_of::<ControlBlock>();
        lowest > 1 && lowest < bottom
    }
}

/// Called by each switch before `running` changes.
pub(super) extern "C" fn check_before_switch() {
    // SAFETY: only the switch calls this, with interrupts masked.
    let masked = &unsafe { Masked::assume() };
    let task = ready::running(masked);
    if task.has_overflowed(masked) {
        kernel_stack_overflow(ptr::from_ref(task).addr());
    }
}

/// Declares the handler of stack overflows, for the feature `stack-check`: a `fn(usize) -> !`, which gets the
/// address of the task's [`Stack`](crate::Stack), as in the linker's map. A program with that feature and
/// without a handler does not link.
///
/// It is called on the kernel's stack, with interrupts masked. Memory below the task's stack, the control
/// block first, is overwritten already. So the handler may record the address and reset the MCU, but must not
/// call the kernel.
///
/// ```ignore
/// kernel::stack_overflow!(board::panic::record_overflow_and_reset);
/// ```
#[macro_export]
macro_rules! stack_overflow {
    ($handler:path) => {
        #[unsafe(no_mangle)]
        extern "C" fn kernel_stack_overflow(stack: usize) -> ! {
            $handler(stack)
        }
    };
}
