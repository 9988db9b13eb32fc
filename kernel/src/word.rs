//! What a semaphore holds: a number of signals or the first waiting task, never both.

use crate::control_block::ControlBlock;
use crate::critical::{Masked, MaskedCell};
use crate::link::{END, Link};

/// Two bytes on the AVR: a number up to 255, a link to the first task of the wait queue, or the end of a wait queue that
/// the last task has left, which counts as no signals. No control block lies below 0x100, where the registers are (ATmega128
/// datasheet, "SRAM Data Memory").
#[repr(transparent)]
pub(crate) struct Word(MaskedCell<Link>);

impl Word {
    pub(crate) const fn new(signals: u8) -> Self {
        Word(MaskedCell::new(Link::signals(signals)))
    }

    /// The first waiting task.
    #[inline(always)]
    pub(crate) fn first(&self, masked: &Masked) -> Option<&'static ControlBlock> {
        self.0.get(masked).task()
    }

    /// Sets what is first in the wait queue: a task, or the queue's end.
    #[inline(always)]
    pub(crate) fn set_first(&self, masked: &Masked, first: Link) {
        self.0.set(masked, first);
    }

    /// The number of signals, where no task waits.
    #[inline(always)]
    pub(crate) fn signals(&self, masked: &Masked) -> u8 {
        let address = self.0.get(masked).address();
        if address & END != 0 { 0 } else { address as u8 }
    }

    /// Sets the number of signals, where no task waits.
    #[inline(always)]
    pub(crate) fn set_signals(&self, masked: &Masked, signals: u8) {
        self.0.set(masked, Link::signals(signals));
    }

    /// Takes a signal, if there is one. Returns whether there was.
    #[inline(always)]
    pub(crate) fn take(&self, masked: &Masked) -> bool {
        // Between 1 and 255: neither empty nor a link.
        let address = self.0.get(masked).address();
        let is_taken = address.wrapping_sub(1) < u8::MAX as usize;
        if is_taken {
            self.0.set(masked, Link::signals((address as u8).wrapping_sub(1)));
        }
        is_taken
    }
}
