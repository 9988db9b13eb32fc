//! Waits that end by themselves.

use core::ptr;

use crate::arch;
use crate::context::{Context, Task};
use crate::masked::{Masked, MaskedCell};
use crate::ready;
use crate::semaphore::Semaphore;
use crate::task::ControlBlock;
use crate::timer::{self, LONGEST, Ticks, Timer};

/// The time of a wait was up before what it waited for came.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Elapsed;

/// What a timer does when a wait's time is up. It lies on the waiting task's stack.
///
/// Timers post semaphores. One that is marked ([`Semaphore::mark_as_timeout`]) is the first field of a `Timeout`, and posting
/// it means to end that wait.
#[repr(C)]
struct Timeout {
    mark: Semaphore,
    semaphore: &'static Semaphore,
    /// The task that waits, once it does.
    task: MaskedCell<Option<&'static ControlBlock>>,
    has_elapsed: MaskedCell<bool>,
}

impl Semaphore {
    /// Takes a signal, and blocks until there is one, for `ticks` ticks at most (1 to [`LONGEST`]).
    ///
    /// # Errors
    /// [`Elapsed`] when the time is up. The task has taken no signal then.
    pub fn wait_timeout(&self, task: &mut Task, ticks: Ticks) -> Result<(), Elapsed> {
        let timer = Timer::new();
        // SAFETY: this borrow ends with the wait below, as the two of `timer` and `timeout` do.
        let semaphore = unsafe { &*ptr::from_ref(self) };
        let timeout = Timeout {
            mark: Semaphore::new(0),
            semaphore,
            task: MaskedCell::new(None),
            has_elapsed: MaskedCell::new(false),
        };
        // SAFETY: both are left alone before this returns: the timer is off its list, because it is due or cancelled.
        let (timer, timeout) = unsafe { (&*ptr::from_ref(&timer), &*ptr::from_ref(&timeout)) };
        if self.try_wait(task) {
            return Ok(());
        }
        task.mask(|masked| timeout.mark.mark_as_timeout(masked));
        let deadline = timer::now(task).wrapping_add(ticks.clamp(1, LONGEST));
        timer::arm(task, timer, deadline, &timeout.mark);
        let is_taken = task.mask(|masked| {
            let is_taken = self.take(masked);
            if !is_taken && !timeout.has_elapsed.get(masked) {
                timeout.task.set(masked, Some(ready::running(masked)));
                self.block(masked);
            }
            is_taken
        });
        if is_taken {
            timer.cancel(task);
            return Ok(());
        }
        // In vain if the time was up already.
        arch::switch_from_call();
        timer.cancel(task);
        if task.mask(|masked| timeout.has_elapsed.get(masked)) { Err(Elapsed) } else { Ok(()) }
    }
}

/// Ends the wait whose mark this is, unless its signal has come before. Returns whether a switch is due.
#[inline(never)]
pub(crate) fn elapse(masked: &Masked, mark: &'static Semaphore) -> bool {
    // SAFETY: only the first field of a `Timeout` is marked, and `wait_timeout` keeps that until the timer is off its list.
    let timeout = unsafe { &*ptr::from_ref(mark).cast::<Timeout>() };
    let Some(task) = timeout.task.get(masked) else {
        // It has not begun to wait.
        timeout.has_elapsed.set(masked, true);
        return false;
    };
    if !timeout.semaphore.expel(masked, task) {
        return false;
    }
    timeout.has_elapsed.set(masked, true);
    ready::make_ready(masked, task)
}
