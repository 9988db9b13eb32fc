//! Counting semaphores in two bytes.

use crate::IDLE;
use crate::arch;
use crate::context::{Context, Task};
use crate::masked::Masked;
use crate::ready;
use crate::task::ControlBlock;
use crate::waiters;
use crate::word::{State, Word};

/// A counting semaphore: up to 255 signals in store, or the tasks that wait for one.
///
/// ```
/// use kernel::Semaphore;
/// static PRESSED: Semaphore = Semaphore::new(0);
/// ```
///
/// Tasks are woken by priority, and in the order in which they came among equals. A signal that finds
/// 255 in store is lost: a semaphore that counts more wants a queue.
pub struct Semaphore {
    word: Word,
}

impl Semaphore {
    /// A semaphore with `signals` in store.
    pub const fn new(signals: u8) -> Self {
        Semaphore { word: Word::new(signals) }
    }

    /// Signals: wakes the first waiting task, or stores the signal when none waits.
    ///
    /// Constant in time. Switches at once if the woken task outranks the caller; from an interrupt, at its end.
    #[inline(always)]
    pub fn post(&self, context: &mut impl Context) {
        #[cfg(not(feature = "fault-unmasked-post"))]
        let is_due = context.mask(|masked| self.signal(masked));
        // SAFETY: none. The tests show what comes of it.
        #[cfg(feature = "fault-unmasked-post")]
        let is_due = self.signal(&unsafe { Masked::assume() });
        context.reschedule(is_due);
    }

    /// Takes a signal, and blocks until there is one.
    #[inline(always)]
    pub fn wait(&self, task: &mut Task) {
        let is_blocked = task.mask(|masked| !self.take_or_block(masked));
        if is_blocked {
            arch::switch();
        }
    }

    /// Takes a signal if one is in store, and says whether it did.
    #[inline(always)]
    pub fn try_wait(&self, context: &mut impl Context) -> bool {
        context.mask(|masked| self.take(masked))
    }

    /// Signals. Returns whether the task it woke is now the one to run.
    #[inline(always)]
    pub(crate) fn signal(&self, masked: &Masked) -> bool {
        match self.word.get(masked) {
            State::Signals(signals) => {
                if signals != u8::MAX {
                    self.word.set_signals(masked, signals + 1);
                }
                false
            }
            State::Waiting(first) => self.wake(masked, first),
        }
    }

    /// Whether at least `number` signals are in store.
    #[inline(always)]
    pub(crate) fn has(&self, masked: &Masked, number: u8) -> bool {
        matches!(self.word.get(masked), State::Signals(signals) if signals >= number)
    }

    /// Wakes the first waiting task. Returns whether it is now the one to run.
    #[inline(always)]
    fn wake(&self, masked: &Masked, first: &'static ControlBlock) -> bool {
        self.word.set_waiting(masked, first.next_waiting(masked));
        ready::make_ready(masked, first)
    }

    /// Takes a signal if one is in store.
    #[inline(always)]
    pub(crate) fn take(&self, masked: &Masked) -> bool {
        match self.word.get(masked) {
            State::Signals(signals @ 1..) => {
                self.word.set_signals(masked, signals - 1);
                true
            }
            _ => false,
        }
    }

    /// Takes a signal if one is in store; else blocks the running task. Returns whether it took one.
    #[inline(always)]
    pub(crate) fn take_or_block(&self, masked: &Masked) -> bool {
        match self.word.get(masked) {
            State::Signals(signals @ 1..) => {
                self.word.set_signals(masked, signals - 1);
                true
            }
            State::Signals(0) => {
                self.block_first(masked);
                false
            }
            State::Waiting(first) => {
                self.block_behind(masked, first);
                false
            }
        }
    }

    /// Blocks the running task: no signal is in store.
    pub(crate) fn block(&self, masked: &Masked) {
        match self.word.get(masked) {
            State::Waiting(first) => self.block_behind(masked, first),
            State::Signals(_) => self.block_first(masked),
        }
    }

    /// Blocks the running task as the first that waits.
    #[cold]
    #[inline(never)]
    fn block_first(&self, masked: &Masked) {
        match ready::block_simply(masked) {
            Some(blocked) => self.set_first(masked, blocked),
            None => self.block_first_for_arrived(masked),
        }
    }

    /// [`block_first`](Self::block_first) where a task that has arrived runs next.
    #[cold]
    #[inline(never)]
    fn block_first_for_arrived(&self, masked: &Masked) {
        self.set_first(masked, ready::block(masked));
    }

    #[inline(always)]
    fn set_first(&self, masked: &Masked, blocked: &'static ControlBlock) {
        blocked.set_next(masked, None);
        self.word.set_waiting(masked, Some(blocked));
    }

    /// Blocks the running task where others wait.
    #[cold]
    #[inline(never)]
    fn block_behind(&self, masked: &Masked, first: &'static ControlBlock) {
        self.word.set_waiting(masked, Some(waiters::insert(masked, first, ready::block(masked))));
    }

    /// Wakes every waiting task. Returns whether one of them is now the one to run.
    pub(crate) fn signal_all(&self, masked: &Masked) -> bool {
        let mut is_due = false;
        while let State::Waiting(_) = self.word.get(masked) {
            is_due |= self.signal(masked);
        }
        is_due
    }

    /// Takes `task` from those that wait. Returns whether it was one of them.
    pub(crate) fn expel(&self, masked: &Masked, task: &'static ControlBlock) -> bool {
        let State::Waiting(first) = self.word.get(masked) else { return false };
        if first.is(task) {
            self.word.set_waiting(masked, task.next_waiting(masked));
            return true;
        }
        waiters::remove(masked, first, task)
    }

    /// Makes this the mark of a [`Timeout`](crate::timeout): no task waits as the idle task.
    pub(crate) fn mark_as_timeout(&self, masked: &Masked) {
        self.word.set_waiting(masked, Some(&IDLE));
    }

    /// Whether this is such a mark.
    #[inline(always)]
    pub(crate) fn is_timeout(&self, masked: &Masked) -> bool {
        matches!(self.word.get(masked), State::Waiting(first) if first.is(&IDLE))
    }
}
