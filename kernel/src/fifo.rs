//! Byte FIFOs between an interrupt and a task.

use crate::context::Context;
use crate::masked::{Masked, MaskedCell};

/// A FIFO of up to `BYTES` bytes, at most 255. Nobody waits on it: where tasks shall, see [`Pipe`](crate::Pipe).
pub struct Fifo<const BYTES: usize> {
    bytes: [MaskedCell<u8>; BYTES],
    /// Where the first byte lies.
    first: MaskedCell<u8>,
    length: MaskedCell<u8>,
    overruns: MaskedCell<u16>,
}

impl<const BYTES: usize> Default for Fifo<BYTES> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const BYTES: usize> Fifo<BYTES> {
    /// An empty FIFO.
    pub const fn new() -> Self {
        const { assert!(BYTES > 0 && BYTES <= 255, "a FIFO holds 1 to 255 bytes") };
        Fifo {
            bytes: [const { MaskedCell::new(0) }; BYTES],
            first: MaskedCell::new(0),
            length: MaskedCell::new(0),
            overruns: MaskedCell::new(0),
        }
    }

    /// Appends `byte`. Returns the free space that is left, or `None` if there was none: the byte is
    /// lost then, and counted.
    #[inline]
    pub fn put(&self, context: &mut impl Context, byte: u8) -> Option<u8> {
        context.mask(|masked| {
            let space = self.append(masked, byte);
            if space.is_none() {
                self.count_overrun(masked);
            }
            space
        })
    }

    /// Removes the first byte, if there is one.
    #[inline]
    pub fn take(&self, context: &mut impl Context) -> Option<u8> {
        context.mask(|masked| self.remove(masked))
    }

    /// The first byte, if there is one. It stays.
    pub fn peek(&self, context: &mut impl Context) -> Option<u8> {
        context.mask(|masked| self.first(masked))
    }

    /// How many bytes there are.
    pub fn length(&self, context: &mut impl Context) -> u8 {
        context.mask(|masked| self.length.get(masked))
    }

    /// How many bytes find space.
    pub fn space(&self, context: &mut impl Context) -> u8 {
        BYTES as u8 - self.length(context)
    }

    /// Drops all bytes.
    pub fn flush(&self, context: &mut impl Context) {
        context.mask(|masked| self.length.set(masked, 0));
    }

    /// How many bytes found no space.
    pub fn overruns(&self, context: &mut impl Context) -> u16 {
        context.mask(|masked| self.overruns.get(masked))
    }

    /// Appends `byte`. Returns the free space that is left, or `None` if there was none.
    #[inline(always)]
    pub(crate) fn append(&self, masked: &Masked, byte: u8) -> Option<u8> {
        let length = self.length.get(masked);
        let index = self.first.get(masked) as usize + length as usize;
        let index = if index >= BYTES { index - BYTES } else { index };
        let cell = self.bytes.get(index).filter(|_| (length as usize) < BYTES)?;
        cell.set(masked, byte);
        self.length.set(masked, length + 1);
        Some((BYTES - 1) as u8 - length)
    }

    /// Removes the first byte, if there is one.
    #[inline(always)]
    pub(crate) fn remove(&self, masked: &Masked) -> Option<u8> {
        let byte = self.first(masked)?;
        let first = self.first.get(masked);
        self.first.set(masked, if first as usize + 1 == BYTES { 0 } else { first + 1 });
        self.length.set(masked, self.length.get(masked).wrapping_sub(1));
        Some(byte)
    }

    pub(crate) fn count_overrun(&self, masked: &Masked) {
        self.overruns.count(masked);
    }

    #[inline(always)]
    fn first(&self, masked: &Masked) -> Option<u8> {
        if self.length.get(masked) == 0 {
            return None;
        }
        self.bytes.get(self.first.get(masked) as usize).map(|cell| cell.get(masked))
    }
}
