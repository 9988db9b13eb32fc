//! What a semaphore holds: a number of signals or the first waiting task, never both.

use crate::masked::Masked;
use crate::task::ControlBlock;

/// A [`Word`]'s content.
pub(crate) enum State {
    Signals(u8),
    Waiting(&'static ControlBlock),
}

#[cfg(target_arch = "avr")]
pub(crate) use packed::Word;
#[cfg(not(target_arch = "avr"))]
pub(crate) use plain::Word;

/// Two bytes: an address, or below 0x100 a number. No control block lies there, where the registers are (ATmega128
/// datasheet, "SRAM Data Memory").
#[cfg(target_arch = "avr")]
mod packed {
    use core::ptr;

    use super::{ControlBlock, Masked, State};
    use crate::masked::MaskedCell;

    #[repr(transparent)]
    pub(crate) struct Word(MaskedCell<*const ControlBlock>);

    impl Word {
        pub(crate) const fn new(signals: u8) -> Self {
            Word(MaskedCell::new(ptr::without_provenance(signals as usize)))
        }

        #[inline(always)]
        pub(crate) fn get(&self, masked: &Masked) -> State {
            let first = self.0.get(masked);
            let [low, high] = first.addr().to_le_bytes();
            if high == 0 {
                State::Signals(low)
            } else {
                // SAFETY: `high` is not 0, so `set_waiting` stored this, made from a static.
                State::Waiting(unsafe { &*first })
            }
        }

        /// Sets the number of signals, where no task waits.
        #[inline(always)]
        pub(crate) fn set_signals(&self, _: &Masked, signals: u8) {
            // The high byte is 0 and stays so: a store saved in the commonest of all calls.
            let low = (&raw const self.0).cast::<u8>().cast_mut();
            // SAFETY: the low byte of a cell, which may be written through a shared reference, with interrupts masked.
            unsafe { low.write(signals) }
        }

        /// Sets the first waiting task; `None` leaves no signal either.
        #[inline(always)]
        pub(crate) fn set_waiting(&self, masked: &Masked, first: Option<&'static ControlBlock>) {
            self.0.set(masked, first.map_or(ptr::null(), ptr::from_ref));
        }
    }
}

/// The same where bytes are plenty.
#[cfg(not(target_arch = "avr"))]
mod plain {
    use super::{ControlBlock, Masked, State};
    use crate::masked::MaskedCell;

    pub(crate) struct Word {
        signals: MaskedCell<u8>,
        waiting: MaskedCell<Option<&'static ControlBlock>>,
    }

    impl Word {
        pub(crate) const fn new(signals: u8) -> Self {
            Word { signals: MaskedCell::new(signals), waiting: MaskedCell::new(None) }
        }

        pub(crate) fn get(&self, masked: &Masked) -> State {
            match self.waiting.get(masked) {
                Some(first) => State::Waiting(first),
                None => State::Signals(self.signals.get(masked)),
            }
        }

        pub(crate) fn set_signals(&self, masked: &Masked, signals: u8) {
            self.signals.set(masked, signals);
        }

        pub(crate) fn set_waiting(&self, masked: &Masked, first: Option<&'static ControlBlock>) {
            self.signals.set(masked, 0);
            self.waiting.set(masked, first);
        }
    }
}
