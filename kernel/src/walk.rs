//! Walks along lists with interrupts enabled between the steps.
//!
//! To find a place in a list takes as long as the list. Each step masks interrupts anew, and between two steps another task
//! may change any list. So whatever changes a list, and whatever makes a task block, ends the walk that is under way; who was
//! walking finds that at the next step, and begins anew: at most once for each task that preempts it. Whoever completes a walk
//! ends it too, as it may have been begun over another that was not to go on.
//!
//! An interrupt does two things to lists: it wakes the first of those that wait, which a walker sees by the list's first, and
//! it appends to those that have arrived, which disturbs no walk. So neither has to end a walk, and posting stays short. Flags
//! that it sets do: they may be what the walker would wait for.

use crate::KERNEL;
use crate::masked::{Masked, MaskedCell};

/// Whether the walk that was begun last goes on.
pub(crate) struct Walk(MaskedCell<bool>);

impl Walk {
    pub(crate) const fn new() -> Self {
        Walk(MaskedCell::new(false))
    }
}

/// Begins a walk.
#[inline(always)]
pub(crate) fn begin(masked: &Masked) {
    KERNEL.walk.0.set(masked, true);
}

/// Whether nothing has happened since [`begin`] but what is said above.
#[inline(always)]
pub(crate) fn goes_on(masked: &Masked) -> bool {
    KERNEL.walk.0.get(masked)
}

/// A list is changed, a task blocks, or a walk is complete.
#[inline(always)]
pub(crate) fn end(masked: &Masked) {
    KERNEL.walk.0.set(masked, false);
}
