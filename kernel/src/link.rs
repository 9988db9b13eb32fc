//! What stands behind a task in its list.

use core::ptr;

use crate::control_block::ControlBlock;
use crate::semaphore::Semaphore;

/// The next task; or at the end of a wait queue the semaphore that its tasks wait for; or why the task is in no list.
///
/// A debugger that follows a waiting task's link so comes to the semaphore. The highest bit, which no address in RAM has
/// set, tells an end from a task.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(transparent)]
pub(crate) struct Link(*const ControlBlock);

// SAFETY: what it points to is a `ControlBlock`, all of whose fields open in critical sections only.
unsafe impl Send for Link {}

/// The bit of what is no task.
pub(crate) const END: usize = 1 << (usize::BITS - 1);

impl Link {
    /// Of a task that has not started, and of a proxy waiter in no list.
    pub(crate) const NONE: Link = Link(ptr::null());
    /// Of a task that waits for a time, or by proxy waiters: it is in no list.
    pub(crate) const BLOCKED: Link = Link(ptr::without_provenance(END | 0x7f00));
    /// Of a task that would be ready, were it not suspended.
    pub(crate) const PARKED: Link = Link(ptr::without_provenance(END | 0x7e00));

    /// To the next task.
    #[inline(always)]
    pub(crate) const fn to(task: &'static ControlBlock) -> Link {
        Link(task)
    }

    /// The end of the wait queue of `semaphore`.
    #[inline(always)]
    pub(crate) fn end_of(semaphore: &Semaphore) -> Link {
        Link(ptr::with_exposed_provenance(ptr::from_ref(semaphore).expose_provenance() | END))
    }

    /// A number of signals, which a semaphore holds where no task waits.
    #[inline(always)]
    pub(crate) const fn signals(signals: u8) -> Link {
        Link(ptr::without_provenance(signals as usize))
    }

    #[inline(always)]
    pub(crate) fn address(self) -> usize {
        self.0.addr()
    }

    /// The semaphore whose wait queue ends here, if one does.
    pub(crate) fn semaphore(self) -> Option<&'static Semaphore> {
        let is_semaphore = self.0.addr() & END != 0 && self != Link::BLOCKED && self != Link::PARKED;
        // SAFETY: every other end was made by `end_of`, and a semaphore lives as long as a task waits for it.
        is_semaphore.then(|| unsafe { &*ptr::with_exposed_provenance(self.0.addr() & !END) })
    }

    /// The task, unless this is an end or a number of signals. Neither has an address above 0xff and below [`END`].
    #[inline(always)]
    pub(crate) fn task(self) -> Option<&'static ControlBlock> {
        let is_task = self.0.addr() as isize > 0xff;
        // SAFETY: no other link lies in this range, so `to` made it from a static.
        is_task.then(|| unsafe { &*self.0 })
    }

    /// The next task in a list that has no end.
    ///
    /// # Safety
    /// The link must be that of a ready task: these queues are circular.
    #[inline(always)]
    pub(crate) unsafe fn next_in_ring(self) -> &'static ControlBlock {
        // SAFETY: the caller's promise: `to` made the link from a static.
        unsafe { &*self.0 }
    }
}
