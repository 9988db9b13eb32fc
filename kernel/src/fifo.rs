//! Byte FIFOs between an interrupt and a task.

use crate::context::Context;
use crate::critical::{Masked, MaskedCell};

/// A FIFO of up to `BYTES` bytes, at most 255. Tasks can't block on it; for that see [`Pipe`](crate::Pipe).
pub struct Fifo<const BYTES: usize> {
    ring: Ring<[MaskedCell<u8>; BYTES]>,
}

impl<const BYTES: usize> Default for Fifo<BYTES> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const BYTES: usize> Fifo<BYTES> {
    /// An empty FIFO.
    pub const fn new() -> Self {
        Fifo { ring: Ring::new() }
    }

    /// Appends `byte`. Returns the free space that is left, or `None` if there was none: the byte is
    /// lost then, and counted.
    #[inline]
    pub fn put(&self, context: &mut impl Context, byte: u8) -> Option<u8> {
        context.mask(|masked| self.ring().put(masked, byte))
    }

    /// Removes the first byte, if there is one.
    #[inline]
    pub fn take(&self, context: &mut impl Context) -> Option<u8> {
        context.mask(|masked| self.ring().take(masked))
    }

    /// The first byte, if there is one. It stays.
    pub fn peek(&self, context: &mut impl Context) -> Option<u8> {
        context.mask(|masked| self.ring().peek(masked))
    }

    /// How many bytes there are.
    pub fn length(&self, context: &mut impl Context) -> u8 {
        context.mask(|masked| self.ring.length.get(masked))
    }

    /// The free space, in bytes.
    pub fn space(&self, context: &mut impl Context) -> u8 {
        BYTES as u8 - self.length(context)
    }

    /// Drops all bytes.
    pub fn flush(&self, context: &mut impl Context) {
        context.mask(|masked| self.ring.length.set(masked, 0));
    }

    /// How many bytes were lost because there was no space.
    pub fn overruns(&self, context: &mut impl Context) -> u16 {
        context.mask(|masked| self.ring.overruns.get(masked))
    }

    #[inline(always)]
    pub(crate) fn ring(&self) -> &Ring {
        &self.ring
    }
}

/// The ring buffer of a FIFO of any length. `bytes` is a slice, so that a program has the code once for all
/// its FIFOs.
pub(crate) struct Ring<Bytes: ?Sized = [MaskedCell<u8>]> {
    /// The index of the first byte.
    first: MaskedCell<u8>,
    length: MaskedCell<u8>,
    overruns: MaskedCell<u16>,
    bytes: Bytes,
}

impl<const BYTES: usize> Ring<[MaskedCell<u8>; BYTES]> {
    const fn new() -> Self {
        const { assert!(BYTES > 0 && BYTES <= 255, "a FIFO holds 1 to 255 bytes") };
        Ring {
            first: MaskedCell::new(0),
            length: MaskedCell::new(0),
            overruns: MaskedCell::new(0),
            bytes: [const { MaskedCell::new(0) }; BYTES],
        }
    }
}

impl Ring {
    /// Appends `byte`. Returns the free space that is left, or `None` if there was none, which is counted.
    #[inline(never)]
    pub(crate) fn put(&self, masked: &Masked, byte: u8) -> Option<u8> {
        let size = self.bytes.len() as u8;
        let (first, length) = (self.first.get(masked), self.length.get(masked));
        let up_to_the_end = size.wrapping_sub(first);
        let index = if length < up_to_the_end {
            first.wrapping_add(length)
        } else {
            length.wrapping_sub(up_to_the_end)
        };
        let Some(cell) = self.bytes.get(index as usize).filter(|_| length < size) else {
            self.count_overrun(masked);
            return None;
        };
        cell.set(masked, byte);
        self.length.set(masked, length + 1);
        Some(size - 1 - length)
    }

    /// Removes the first byte, if there is one.
    #[inline(never)]
    pub(crate) fn take(&self, masked: &Masked) -> Option<u8> {
        let byte = self.peek(masked)?;
        let next = self.first.get(masked).wrapping_add(1);
        self.first.set(masked, if next == self.bytes.len() as u8 { 0 } else { next });
        self.length.set(masked, self.length.get(masked).wrapping_sub(1));
        Some(byte)
    }

    /// The first byte, if there is one.
    #[inline]
    fn peek(&self, masked: &Masked) -> Option<u8> {
        if self.length.get(masked) == 0 {
            return None;
        }
        self.bytes.get(self.first.get(masked) as usize).map(|cell| cell.get(masked))
    }

    pub(crate) fn count_overrun(&self, masked: &Masked) {
        self.overruns.count(masked);
    }
}
