//! Counting semaphores in two bytes.

use crate::arch;
use crate::context::{Context, Task};
use crate::critical::Masked;
use crate::word::Word;

/// A counting semaphore: up to 255 signals in store, or the tasks that wait for one.
///
/// ```
/// use kernel::Semaphore;
/// static PRESSED: Semaphore = Semaphore::new(0);
/// ```
///
/// Tasks are woken by priority, and in the order in which they came among equals. A signal that finds
/// 255 in store is lost: a semaphore that counts more wants a queue.
#[repr(transparent)]
pub struct Semaphore {
    pub(crate) word: Word,
}

impl Semaphore {
    /// A semaphore with `signals` in store.
    pub const fn new(signals: u8) -> Self {
        Semaphore { word: Word::new(signals) }
    }

    /// Signals: wakes the first waiting task, or stores the signal when none waits.
    ///
    /// Constant time, except for waits that have timed out and whose tasks have not run since: each passes
    /// the signal on to the next. Switches at once if the woken task outranks the caller; from an interrupt,
    /// at its end.
    #[inline(always)]
    pub fn post(&self, context: &mut impl Context) {
        // Inlined, since this is on the path from an interrupt to its task.
        if context.is_interrupt() {
            context.mask(|masked| self.word.signal(masked)); // the ISR switches at its end, if due
            return;
        }
        #[cfg(not(feature = "fault-unmasked-post"))]
        let is_due = context.mask(|masked| self.post_masked(masked));
        // SAFETY: none: this is a planted fault, for tests to find.
        #[cfg(feature = "fault-unmasked-post")]
        let is_due = self.post_masked(&unsafe { Masked::assume() });
        context.reschedule(is_due);
    }

    #[inline(always)]
    fn post_masked(&self, masked: &Masked) -> bool {
        if self.word.is_awaited(masked) {
            return self.word.signal_by_call(masked);
        }
        self.word.add_signal(masked, u8::MAX);
        false
    }

    /// [Posts](Self::post) from a task's loop: the compiler saves only the registers that are live there. Up
    /// to 72 cycles less to the woken task and back, for more flash. In a function that is called, it instead
    /// saves all that a call preserves, each time.
    #[inline(always)]
    pub fn post_in_loop(&self, task: &mut Task) {
        if task.mask(|masked| self.post_masked(masked)) {
            arch::switch(task);
        }
    }

    /// Takes a signal, and blocks until there is one.
    #[inline(always)]
    pub fn wait(&self, task: &mut Task) {
        if self.word.block(task) {
            arch::switch(task);
        }
    }

    /// [Waits](Self::wait) by a function call, which preserves the registers that any call preserves. It
    /// takes less flash than `wait` outside of a task's loop, in a function that is called from several
    /// places. 10 cycles more if there is a signal, and about 120 if the task blocks.
    #[inline(never)]
    pub fn wait_by_call(&self, task: &mut Task) {
        if self.word.block(task) {
            arch::switch_from_call(task);
        }
    }

    /// Takes a signal if one is in store. Returns whether it did.
    #[inline(always)]
    pub fn try_wait(&self, context: &mut impl Context) -> bool {
        context.mask(|masked| self.word.take(masked))
    }
}
