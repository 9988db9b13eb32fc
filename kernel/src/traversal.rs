//! Traversals of lists with interrupts enabled between the steps.
//!
//! Finding a place in a list takes time in proportion to its length. Each step is a critical section of its
//! own, and between two steps another task may change any list. So every change of a list, and every task
//! that blocks, invalidates the traversal under way. Its task finds that at the next step and restarts, at
//! most once for each task that preempts it. A complete traversal is invalid too: it may have begun after
//! another one, which must restart. For the same reason resuming or stepping a suspended task invalidates the
//! traversal under way, which may be that of a lower task.
//!
//! An ISR does two things to lists. It wakes the first task of a wait queue, which a traversal sees by a
//! changed first task. And it appends to queues of ready tasks, which does not disturb a traversal. Neither
//! has to invalidate one, so posting stays short. Setting event flags wakes all tasks that wait for them, so
//! a task that is about to wait finds another first task, too, or none. An ISR that resumes a suspended task
//! invalidates the traversal: the task may have one of its own under way.

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

/// Runs a traversal: one critical section per `step`, until a step returns a result.
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
