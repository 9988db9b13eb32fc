//! What links the lists of tasks.

use core::ptr;

#[cfg(not(target_arch = "avr"))]
use crate::semaphore::Semaphore;
use crate::task::ControlBlock;

/// What stands behind a task in its list: the next task, or at the end of a list of waiting tasks what they wait for.
///
/// So a debugger that follows a waiting task's link comes to its semaphore. One bit that no address has set tells which: on
/// the AVR bit 15, as SRAM ends below 0x8000.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(transparent)]
pub(crate) struct Link(*const ControlBlock);

#[cfg(target_arch = "avr")]
pub(crate) const END: usize = 0x8000;
#[cfg(not(target_arch = "avr"))]
const END: usize = 1;

/// Ends without a semaphore. No SRAM reaches so far: the high byte of each is that of no other link.
pub(crate) const DELAYED: usize = END | 0x7f00;
pub(crate) const GROUPED: usize = END | 0x7e00;
pub(crate) const PARKED: usize = END | 0x7d00;

impl Link {
    /// Of a task that has not started, or has ended.
    pub(crate) const NONE: Link = Link(ptr::null());
    /// Of a task that waits for nothing but a timer.
    #[cfg(not(target_arch = "avr"))]
    pub(crate) const DELAYED: Link = Link(ptr::without_provenance(DELAYED));
    /// Of a task that would be ready, were it not suspended.
    pub(crate) const PARKED: Link = Link(ptr::without_provenance(PARKED));
    /// Of a task for which others wait: see [`group`](crate::group).
    pub(crate) const GROUPED: Link = Link(ptr::without_provenance(GROUPED));

    /// To the next task.
    #[inline(always)]
    pub(crate) fn to(task: &'static ControlBlock) -> Link {
        Link(task)
    }

    /// The end of the list of those that wait for `semaphore`.
    #[cfg(not(target_arch = "avr"))]
    pub(crate) fn end_of(semaphore: &Semaphore) -> Link {
        Link(ptr::with_exposed_provenance(ptr::from_ref(semaphore).expose_provenance() | END))
    }

    #[inline(always)]
    pub(crate) fn raw(self) -> *const ControlBlock {
        self.0
    }

    #[inline(always)]
    pub(crate) fn is_end(self) -> bool {
        self.0.addr() & END != 0
    }

    /// What the tasks wait for whose list ends here, if that is a semaphore.
    #[cfg(not(target_arch = "avr"))]
    pub(crate) fn semaphore(self) -> Option<&'static Semaphore> {
        let is_semaphore = self.is_end() && ![Link::DELAYED, Link::PARKED, Link::GROUPED].contains(&self);
        // SAFETY: `end_of` made it from a semaphore, which lives as long as a task waits for it.
        is_semaphore.then(|| unsafe { &*ptr::with_exposed_provenance(self.0.addr() & !END) })
    }

    /// The next task, unless this is an end.
    #[inline(always)]
    pub(crate) fn task(self) -> Option<&'static ControlBlock> {
        // SAFETY: what is no end is null or was made from a static.
        if self.is_end() { None } else { unsafe { self.0.as_ref() } }
    }
}
