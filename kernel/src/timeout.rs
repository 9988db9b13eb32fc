//! Waits that end by themselves.

use core::ptr;

use crate::arch;
use crate::context::{Context, Expiry, Task};
use crate::list;
#[cfg(not(target_arch = "avr"))]
use crate::masked::Masked;
use crate::masked::MaskedCell;
use crate::ready;
use crate::semaphore::{Came, Semaphore, Until};
use crate::target::Target;
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
pub(crate) struct Timeout {
    mark: Semaphore,
    semaphore: &'static Semaphore,
    task: &'static ControlBlock,
    /// [`FIRED`], and then perhaps [`EXPELLED`].
    state: MaskedCell<u8>,
}

/// The time is up.
const FIRED: u8 = 1;
/// The task was waiting then.
const EXPELLED: u8 = 2;

impl Semaphore {
    /// Takes a signal, and blocks until there is one, for `ticks` ticks at most (1 to [`LONGEST`]).
    ///
    /// # Errors
    /// [`Elapsed`] when the time is up. The task has taken no signal then.
    pub fn wait_timeout(&self, task: &mut Task, ticks: Ticks) -> Result<(), Elapsed> {
        if self.try_wait(task) {
            return Ok(());
        }
        #[cfg(target_arch = "avr")]
        arch::name_elapse();
        let timer = Timer::new();
        let timeout = Timeout {
            mark: Semaphore::new(0),
            // SAFETY: this borrow ends with the wait below, as the two of `timer` and `timeout` do.
            semaphore: unsafe { &*ptr::from_ref(self) },
            task: task.mask(ready::running),
            state: MaskedCell::new(0),
        };
        // SAFETY: both are left alone before this returns: the timer is off its list, because it is due or cancelled.
        let (timer, timeout) = unsafe { (&*ptr::from_ref(&timer), &*ptr::from_ref(&timeout)) };
        task.mask(|masked| timeout.mark.mark_as_timeout(masked));
        let deadline = timer::now(task).wrapping_add(ticks.clamp(1, LONGEST));
        if !timer::arm(task, timer, deadline, Target::semaphore(&timeout.mark)) {
            // It has passed already.
            return if self.try_wait(task) { Ok(()) } else { Err(Elapsed) };
        }
        let until = Until::any(&timeout.state, FIRED);
        let is_taken = match self.block_until(task, Some(&until)) {
            Came::Signal => true,
            Came::Until => false,
            Came::Blocked => {
                arch::switch_from_call();
                task.mask(|masked| timeout.state.get(masked) & EXPELLED == 0)
            }
        };
        timer.cancel(task);
        if is_taken { Ok(()) } else { Err(Elapsed) }
    }
}

impl Timeout {
    /// The wait whose mark `semaphore` is, if it is one.
    #[cfg(not(target_arch = "avr"))]
    pub(crate) fn marked(masked: &Masked, semaphore: &'static Semaphore) -> Option<&'static Timeout> {
        if !semaphore.is_timeout(masked) {
            return None;
        }
        // SAFETY: only the first field of a `Timeout` is marked, and its task does not run before its timer has expired.
        Some(unsafe { &*ptr::from_ref(semaphore).cast() })
    }

    /// Ends the wait, unless its signal has come before or it has not begun.
    pub(crate) extern "C" fn elapse(&self) {
        // SAFETY: only the tick's interrupt calls this, with interrupts masked.
        let expiry = &mut unsafe { Expiry::assume() };
        // A tick has ended any walk that was under way.
        expiry.peek(|masked| self.state.set(masked, FIRED));
        list::expel(expiry, self.semaphore, self.task, |masked| {
            self.state.set(masked, FIRED | EXPELLED);
            arch::make_ready(masked, self.task);
        });
    }
}
