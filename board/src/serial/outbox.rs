//! The bytes to be sent on a line, from the slice that a task lends.

use core::cell::Cell;
use core::ptr;

/// The bytes that are left.
pub struct Outbox {
    next: Cell<*const u8>,
    end: Cell<*const u8>,
}

// SAFETY: the pointers are only followed while the bytes are there, as `fill` requires, whichever context
// does it.
unsafe impl Send for Outbox {}

impl Outbox {
    /// Nothing to send.
    pub const fn new() -> Outbox {
        Outbox { next: Cell::new(ptr::null()), end: Cell::new(ptr::null()) }
    }

    /// Makes `bytes` all that is to be sent.
    ///
    /// # Safety
    /// They must stay as they are until all are taken.
    #[inline(always)]
    pub unsafe fn fill(&self, bytes: &[u8]) {
        let bytes = bytes.as_ptr_range();
        self.next.set(bytes.start);
        self.end.set(bytes.end);
    }

    /// Whether all are taken.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.next == self.end
    }

    /// Takes the next byte, and whether it is the last.
    #[inline(always)]
    pub fn take(&self) -> Option<(u8, bool)> {
        let (next, end) = (self.next.get(), self.end.get());
        if next == end {
            return None;
        }
        // SAFETY: the caller of `fill` guarantees that there are bytes from here to `end`.
        let byte = unsafe { *next };
        let next = next.wrapping_add(1);
        self.next.set(next);
        Some((byte, next == end))
    }
}
