//! What a semaphore holds: a number of signals or the first waiting task, never both.

use core::ptr;

use crate::control_block::{ControlBlock, Flag};
use crate::critical::Masked;
use crate::link::{Link, LinkCell};

/// Two bytes on the AVR: a number up to 255, a link to the first task of the wait queue, or the end of a wait
/// queue that the last task has left, which counts as no signals.
#[repr(transparent)]
pub(crate) struct Word(LinkCell);

impl Word {
    pub(crate) const fn new(signals: u8) -> Self {
        Word(LinkCell::new(Link::signals(signals)))
    }

    /// Whether tasks wait.
    #[inline(always)]
    pub(crate) fn is_awaited(&self, masked: &Masked) -> bool {
        self.0.kind(masked) > 0
    }

    /// The first waiting task.
    #[inline(always)]
    pub(crate) fn first(&self, masked: &Masked) -> Option<&'static ControlBlock> {
        self.0.task(masked)
    }

    /// Sets what is first in the wait queue: a task, or the queue's end.
    #[inline(always)]
    pub(crate) fn set_first(&self, masked: &Masked, first: Link) {
        self.0.set(masked, first);
    }

    /// Stores a signal if fewer than `room` are in store; no task may wait. Returns whether it did.
    #[inline(always)]
    pub(crate) fn add_signal(&self, masked: &Masked, room: u8) -> bool {
        if self.0.kind(masked) != 0 {
            self.0.set(masked, Link::signals(0)); // in place of the end of a queue
        }
        let signals = self.0.signals(masked);
        let has_room = signals < room;
        if has_room {
            self.0.set_signals(masked, signals.wrapping_add(1));
        }
        has_room
    }

    /// Takes a signal, if there is one. Returns whether there was.
    #[inline(always)]
    pub(crate) fn take(&self, masked: &Masked) -> bool {
        if self.0.kind(masked) != 0 {
            return false;
        }
        let signals = self.0.signals(masked);
        if signals != 0 {
            self.0.set_signals(masked, signals.wrapping_sub(1));
        }
        signals != 0
    }
}

impl Link {
    /// The end of the wait queue of `word`.
    #[inline(always)]
    pub(crate) fn end_of(word: &Word) -> Link {
        Link::end_at(ptr::from_ref(word).cast())
    }

    /// The semaphore whose wait queue ends here, if one does. `task` is the task whose link this is.
    pub(crate) fn word(self, masked: &Masked, task: &ControlBlock) -> Option<&'static Word> {
        let object = self.object().filter(|_| !task.has_flag(masked, Flag::Proxied))?;
        // SAFETY: `end_of` made it, and a semaphore lives as long as a task waits for it.
        Some(unsafe { &*object.cast() })
    }
}
