//! Counting semaphores in two bytes.

use core::ptr;

use crate::IDLE;
use crate::arch;
use crate::context::{Context, Task};
use crate::masked::{Masked, MaskedCell};
use crate::ready;
use crate::task::ControlBlock;
use crate::waiters;

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
    word: MaskedCell<Word>,
}

impl Semaphore {
    /// A semaphore with `signals` in store.
    pub const fn new(signals: u8) -> Self {
        Semaphore { word: MaskedCell::new(Word::signals(signals)) }
    }

    /// Signals: wakes the first waiting task, or stores the signal when none waits.
    ///
    /// Constant in time. Switches at once if the woken task outranks the caller; from an interrupt, at its end.
    #[inline(always)]
    pub fn post(&self, context: &mut impl Context) {
        let is_due = context.mask(|masked| self.signal(masked));
        context.reschedule(is_due);
    }

    /// Takes a signal, and blocks until there is one.
    #[inline(always)]
    pub fn wait(&self, task: &mut Task) {
        let is_blocked = task.mask(|masked| match self.word.get(masked).state() {
            State::Waiting(first) => {
                self.block_behind(masked, first);
                true
            }
            State::Signals(0) => {
                self.block_first(masked);
                true
            }
            State::Signals(signals) => {
                self.word.set(masked, Word::signals(signals - 1));
                false
            }
        });
        if is_blocked {
            arch::switch();
        }
    }

    /// Takes a signal if one is in store, and says whether it did.
    #[inline(always)]
    pub fn try_wait(&self, context: &mut impl Context) -> bool {
        context.mask(|masked| self.take(masked))
    }

    /// The mark of a [`Timeout`](crate::timeout): no semaphore that a task waits on.
    pub(crate) const fn timeout() -> Self {
        Semaphore { word: MaskedCell::new(Word::TIMEOUT) }
    }

    /// Whether this is such a mark.
    pub(crate) fn is_timeout(&self, masked: &Masked) -> bool {
        self.word.get(masked).0 == Word::TIMEOUT.0
    }

    /// Takes `task` from those that wait. Returns whether it was one of them.
    pub(crate) fn expel(&self, masked: &Masked, task: &'static ControlBlock) -> bool {
        let State::Waiting(first) = self.word.get(masked).state() else { return false };
        if first.is(task) {
            self.word.set(masked, task.next_waiting(masked).map_or(Word::signals(0), Word::waiting));
            return true;
        }
        waiters::remove(masked, first, task)
    }

    /// Wakes every waiting task. Returns whether one of them is now the one to run.
    pub(crate) fn signal_all(&self, masked: &Masked) -> bool {
        let mut is_due = false;
        while let State::Waiting(_) = self.word.get(masked).state() {
            is_due |= self.signal(masked);
        }
        is_due
    }

    /// Signals. Returns whether the task it woke is now the one to run.
    #[inline(always)]
    pub(crate) fn signal(&self, masked: &Masked) -> bool {
        match self.word.get(masked).state() {
            State::Signals(signals) => {
                self.word.set(masked, Word::signals(signals.saturating_add(1)));
                false
            }
            State::Waiting(first) => {
                self.word.set(masked, first.next_waiting(masked).map_or(Word::signals(0), Word::waiting));
                ready::make_ready(masked, first)
            }
        }
    }

    /// Takes a signal if one is in store.
    #[inline(always)]
    pub(crate) fn take(&self, masked: &Masked) -> bool {
        match self.word.get(masked).state() {
            State::Signals(0) | State::Waiting(_) => false,
            State::Signals(signals) => {
                self.word.set(masked, Word::signals(signals - 1));
                true
            }
        }
    }

    /// Blocks the running task: no signal is in store.
    pub(crate) fn block(&self, masked: &Masked) {
        match self.word.get(masked).state() {
            State::Waiting(first) => self.block_behind(masked, first),
            State::Signals(_) => self.block_first(masked),
        }
    }

    /// Blocks the running task as the first that waits.
    #[inline(never)]
    fn block_first(&self, masked: &Masked) {
        let blocked = ready::block(masked);
        blocked.set_next(masked, None);
        self.word.set(masked, Word::waiting(blocked));
    }

    /// Blocks the running task where others wait.
    #[inline(never)]
    fn block_behind(&self, masked: &Masked, first: &'static ControlBlock) {
        self.word.set(masked, Word::waiting(waiters::insert(masked, first, ready::block(masked))));
    }
}

/// What a semaphore holds: a number of signals, or the first waiting task.
enum State {
    Signals(u8),
    Waiting(&'static ControlBlock),
}

/// A [`State`] in one pointer: no control block lies in the first 256 bytes of memory, which on the AVR
/// are registers (ATmega128 datasheet, "SRAM Data Memory") and on the host belong to no one.
#[derive(Clone, Copy)]
struct Word(*const ControlBlock);

impl Word {
    /// No task waits as the idle task.
    const TIMEOUT: Word = Word(&raw const IDLE);

    const fn signals(number: u8) -> Self {
        Word(ptr::without_provenance(number as usize))
    }

    fn waiting(first: &'static ControlBlock) -> Self {
        Word(first)
    }

    #[inline(always)]
    fn state(self) -> State {
        match u8::try_from(self.0.addr()) {
            Ok(signals) => State::Signals(signals),
            // SAFETY: an address above 255 was stored by `waiting`, from a reference to a static.
            Err(_) => State::Waiting(unsafe { &*self.0 }),
        }
    }
}
