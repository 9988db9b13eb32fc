//! The stack check, for the feature `stack-check`: at each switch, whether the task that ran has left its
//! stack.
//!
//! A control block lies below its stack, so the address of one tells where the other ends. What a function
//! used and has given back by then does not show: [`TaskHandle::is_intact`](crate::TaskHandle::is_intact)
//! shows that.
//!
//! A call of the kernel that overflows the stack by several bytes may overwrite the control block before it
//! comes to the switch, and go wrong there.

use core::ptr;

use super::IDLE_CONTEXT;
use crate::control_block::ControlBlock;
use crate::critical::Masked;
use crate::ready;

unsafe extern "C" {
    /// What the program does then: see [`stack_overflow!`](crate::stack_overflow!).
    safe fn kernel_stack_overflow(stack: usize) -> !;
}

impl ControlBlock {
    /// Whether the saved context reaches below the stack.
    fn has_overflowed(&self, masked: &Masked) -> bool {
        let stack_pointer = self.stack_pointer.get(masked);
        // A preempted context's leads to its lowest byte, a voluntary one's to the free byte below. 0 is the
        // idle task, and 1 one that has ended.
        let is_preempted = stack_pointer & IDLE_CONTEXT != 0;
        let lowest = if is_preempted { stack_pointer & !IDLE_CONTEXT } else { stack_pointer + 1 };
        let bottom = ptr::from_ref(self).addr() + size_of::<ControlBlock>();
        lowest > 1 && lowest < bottom
    }
}

/// What a switch does before another task is the running one.
pub(super) extern "C" fn check_before_switch() {
    // SAFETY: only the switch calls this, with interrupts masked.
    let masked = &unsafe { Masked::assume() };
    let task = ready::running(masked);
    if task.has_overflowed(masked) {
        kernel_stack_overflow(ptr::from_ref(task).addr());
    }
}

/// Declares what happens where a task has overflowed its stack, for the feature `stack-check`: a
/// `fn(usize) -> !`, which gets the address of the task's [`Stack`](crate::Stack), as the linker's map has
/// it.
/// Without it a program with that feature does not link.
///
/// It is called on the kernel's stack, with interrupts masked. What lies below the task's stack is
/// overwritten already, its control block first: so it may record the address and reset the MCU, but call the
/// kernel no more.
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
