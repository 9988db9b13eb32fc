//! What a semaphore holds: a number of signals or the first waiting task, never both.

use crate::link::Link;
use crate::masked::Masked;
use crate::task::ControlBlock;

/// A [`Word`]'s content.
pub(crate) enum State {
    Signals(u8),
    /// Tasks wait: see [`Word::first`].
    Waiting,
    /// No signals, as left by the last task that waited.
    Empty,
}

#[cfg(target_arch = "avr")]
pub(crate) use packed::Word;
#[cfg(not(target_arch = "avr"))]
pub(crate) use plain::Word;

/// Two bytes: a link, or below 0x100 a number. No control block lies there, where the registers are (ATmega128
/// datasheet, "SRAM Data Memory"). The commonest calls look at one of the bytes alone.
#[cfg(target_arch = "avr")]
mod packed {
    use core::{hint, ptr};

    use super::{ControlBlock, Link, Masked, State};
    use crate::masked::MaskedCell;

    #[repr(transparent)]
    pub(crate) struct Word(MaskedCell<*const ControlBlock>);

    impl Word {
        pub(crate) const fn new(signals: u8) -> Self {
            Word(MaskedCell::new(ptr::without_provenance(signals as usize)))
        }

        #[inline(always)]
        fn byte(&self, index: usize) -> &MaskedCell<u8> {
            // SAFETY: the cell has two bytes, and one of a byte may stand for either of them.
            unsafe { &*(&raw const self.0).cast::<MaskedCell<u8>>().add(index & 1) }
        }

        #[inline(always)]
        pub(crate) fn get(&self, masked: &Masked) -> State {
            let high = self.byte(1).get(masked) as i8;
            if high > 0 {
                return State::Waiting;
            }
            if high == 0 { State::Signals(self.byte(0).get(masked)) } else { State::Empty }
        }

        /// The first waiting task.
        #[inline(always)]
        pub(crate) fn first(&self, masked: &Masked) -> Option<&'static ControlBlock> {
            let word = self.0.get(masked);
            if (word.addr() >> 8) as i8 <= 0 {
                return None;
            }
            // SAFETY: neither a number nor an end, so `set_link` stored this, made from a static. The compiler looks no more.
            unsafe {
                hint::assert_unchecked(!word.is_null());
                Some(&*word)
            }
        }

        /// Sets the number of signals, where there is a number.
        #[inline(always)]
        pub(crate) fn set_signals(&self, masked: &Masked, signals: u8) {
            self.byte(0).set(masked, signals);
        }

        /// Sets what stands first in the list of waiting tasks, its end if none does.
        #[inline(always)]
        pub(crate) fn set_link(&self, masked: &Masked, first: Link) {
            self.0.set(masked, first.raw());
        }
    }
}

/// The same where bytes are plenty.
#[cfg(not(target_arch = "avr"))]
mod plain {
    use super::{ControlBlock, Link, Masked, State};
    use crate::masked::MaskedCell;

    pub(crate) struct Word {
        signals: MaskedCell<u8>,
        waiting: MaskedCell<Link>,
    }

    impl Word {
        pub(crate) const fn new(signals: u8) -> Self {
            Word { signals: MaskedCell::new(signals), waiting: MaskedCell::new(Link::NONE) }
        }

        pub(crate) fn get(&self, masked: &Masked) -> State {
            let link = self.waiting.get(masked);
            match link.task() {
                Some(_) => State::Waiting,
                None if link.is_end() => State::Empty,
                None => State::Signals(self.signals.get(masked)),
            }
        }

        pub(crate) fn first(&self, masked: &Masked) -> Option<&'static ControlBlock> {
            self.waiting.get(masked).task()
        }

        pub(crate) fn set_signals(&self, masked: &Masked, signals: u8) {
            self.signals.set(masked, signals);
        }

        pub(crate) fn reset(&self, masked: &Masked, signals: u8) {
            self.signals.set(masked, signals);
            self.waiting.set(masked, Link::NONE);
        }

        pub(crate) fn set_link(&self, masked: &Masked, first: Link) {
            self.waiting.set(masked, first);
        }
    }
}
