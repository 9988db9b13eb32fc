//! Walks along lists with interrupts enabled between the steps.
//!
//! A list of timers or of waiting tasks is sorted, so to find a place in it takes as long as the list. Each step masks
//! interrupts anew, and between two steps anything may happen to any list. So whatever changes one of these lists ends the
//! walk that is under way, as does whoever completes one; who was walking finds that at the next step, and begins anew. A task restarts at most once for
//! each task or interrupt that preempts it meanwhile; those are short, and the higher task never waits.

use crate::KERNEL;
use crate::masked::{Masked, MaskedCell};

/// Whether the walk begun last goes on.
pub(crate) struct Walk(MaskedCell<bool>);

impl Walk {
    pub(crate) const fn new() -> Self {
        Walk(MaskedCell::new(false))
    }
}

/// Begins a walk at the start of a list. One that was under way in a preempted task has to begin anew: this walk is over
/// before that task runs again, and has called [`end`].
#[inline(always)]
pub(crate) fn begin(masked: &Masked) {
    KERNEL.walk.0.set(masked, true);
}

/// Whether no list has changed since [`begin`].
#[inline(always)]
pub(crate) fn goes_on(masked: &Masked) -> bool {
    KERNEL.walk.0.get(masked)
}

/// A list is changed, or a walk completed.
#[inline(always)]
pub(crate) fn end(masked: &Masked) {
    KERNEL.walk.0.set(masked, false);
}
