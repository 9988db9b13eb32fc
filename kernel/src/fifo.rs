//! Byte FIFOs between an interrupt and a task.

use crate::context::Context;
use crate::masked::MaskedCell;

/// A FIFO of up to `BYTES` bytes, at most 255.
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
            let length = self.length.get(masked);
            let index = self.first.get(masked) as usize + length as usize;
            let index = if index >= BYTES { index - BYTES } else { index };
            match self.bytes.get(index) {
                Some(cell) if (length as usize) < BYTES => {
                    cell.set(masked, byte);
                    self.length.set(masked, length + 1);
                    Some((BYTES - 1) as u8 - length)
                }
                _ => {
                    self.overruns.count(masked);
                    None
                }
            }
        })
    }

    /// Removes the first byte, if there is one.
    #[inline]
    pub fn take(&self, context: &mut impl Context) -> Option<u8> {
        context.mask(|masked| {
            let length = self.length.get(masked).checked_sub(1)?;
            let first = self.first.get(masked);
            let byte = self.bytes.get(first as usize)?.get(masked);
            self.first.set(masked, if first as usize + 1 == BYTES { 0 } else { first + 1 });
            self.length.set(masked, length);
            Some(byte)
        })
    }

    /// How many bytes found no space.
    pub fn overruns(&self, context: &mut impl Context) -> u16 {
        context.mask(|masked| self.overruns.get(masked))
    }
}
