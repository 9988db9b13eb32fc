//! What a timer wakes.

use core::ptr;

use crate::semaphore::Semaphore;
#[cfg(not(target_arch = "avr"))]
use crate::{
    arch,
    context::{Context, Expiry},
    link::Link,
    task::ControlBlock,
    timeout::Timeout,
};

/// A semaphore to post, or a task to wake whose delay is over; or nothing. One bit that no address has set marks a task.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(crate) struct Target(*const Semaphore);

#[cfg(not(target_arch = "avr"))]
const TASK: usize = 1;

impl Target {
    pub(crate) const NOTHING: Target = Target(ptr::null());

    pub(crate) fn semaphore(semaphore: &'static Semaphore) -> Target {
        Target(semaphore)
    }

    #[cfg(not(target_arch = "avr"))]
    pub(crate) fn task(task: &'static ControlBlock) -> Target {
        Target(ptr::with_exposed_provenance(ptr::from_ref(task).expose_provenance() | TASK))
    }

    #[inline(always)]
    pub(crate) fn is_nothing(self) -> bool {
        self.0.is_null()
    }

    /// Wakes it, a task only if its delay has begun; ends the wait, if it is a time-out's.
    #[cfg(not(target_arch = "avr"))]
    pub(crate) fn wake(self, expiry: &mut Expiry) {
        if self.0.addr() & TASK != 0 {
            // SAFETY: made from a static by `task`.
            let task: &ControlBlock = unsafe { &*ptr::with_exposed_provenance(self.0.addr() & !TASK) };
            expiry.mask(|masked| {
                if task.link.get(masked) == Link::DELAYED {
                    arch::make_ready(masked, task);
                }
            });
        // SAFETY: null or made from a static, or from what outlives the timer, by `semaphore`.
        } else if let Some(semaphore) = unsafe { self.0.as_ref() } {
            wake_semaphore(expiry, semaphore);
        }
    }
}

#[cfg(not(target_arch = "avr"))]
fn wake_semaphore(expiry: &mut Expiry, semaphore: &'static Semaphore) {
    // A section of its own: what is a mark stays one, as no task runs meanwhile.
    match expiry.mask(|masked| Timeout::marked(masked, semaphore)) {
        Some(timeout) => timeout.elapse(),
        None => expiry.mask(|masked| {
            arch::signal(masked, semaphore, true);
        }),
    }
}
