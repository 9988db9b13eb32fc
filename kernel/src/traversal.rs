//! Traversals of lists with interrupts enabled between the steps.
//!
//! To find a place in a list takes as long as the list. Each step is a critical section of its own, and
//! between two steps another task may change any list. So whatever changes a list, and whatever makes a task
//! block, invalidates the traversal under way; its task finds that at the next step and restarts, at most
//! once for each task that preempts it. A traversal that is complete is invalid too: it may have begun after
//! another one that must restart. So may that of a lower task, which a suspended one finds under way where it
//! is resumed or stepped: both invalidate it.
//!
//! An ISR does two things to lists. It wakes the first task of a wait queue, which a traversal sees by the
//! queue's first, and it appends to queues of ready tasks, which disturbs no traversal. Neither has to
//! invalidate one, so posting stays short. Who sets event flags wakes all that wait for them, so a task
//! that is about to wait sees another first, too, or none. A suspended task that an ISR resumes invalidates
//! a traversal: it may have one of its own under way.

use crate::KERNEL;
use crate::arch;
use crate::context::Context;
use crate::critical::{Masked, MaskedCell};

/// Whether the traversal that began last is valid.
pub(crate) struct Traversal(MaskedCell<bool>);

impl Traversal {
    pub(crate) const fn new() -> Self {
        Traversal(MaskedCell::new(false))
    }
}

/// Makes a traversal: a critical section for each `step`, until one returns something.
#[inline(always)]
pub(crate) fn make<R>(context: &mut impl Context, mut step: impl FnMut(&Masked) -> Option<R>) -> R {
    loop {
        let result = context.mask(|masked| step(masked).inspect(|_| end(masked)));
        if let Some(result) = result {
            return result;
        }
        arch::irq_window();
    }
}

/// Begins a traversal.
#[inline(always)]
pub(crate) fn begin(masked: &Masked) {
    KERNEL.traversal.0.set(masked, true);
}

/// Whether the traversal that began last may continue.
#[inline(always)]
pub(crate) fn is_valid(masked: &Masked) -> bool {
    KERNEL.traversal.0.get(masked)
}

/// Invalidates the traversal under way: a list changes, a task blocks, or the traversal is complete.
#[inline(always)]
pub(crate) fn end(masked: &Masked) {
    KERNEL.traversal.0.set(masked, false);
}
