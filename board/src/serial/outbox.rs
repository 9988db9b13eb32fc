//! What is to be sent on a line, byte by byte, from the slice that a task lends.

/// The bytes that are left.
#[doc(hidden)]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Outbox {
    next: *const u8,
    left: u16,
}

// SAFETY: a task lends the bytes for the time that it waits, and a killed task's stack stays as it is. Only the vectors read
// them.
unsafe impl Send for Outbox {}

/// Offsets for the vectors.
#[doc(hidden)]
pub mod offset {
    use core::mem::offset_of;

    use super::Outbox;
    use crate::serial::Port;

    pub const NEXT: usize = Port::OUTBOX + offset_of!(Outbox, next);
    pub const LEFT: usize = Port::OUTBOX + offset_of!(Outbox, left);
}

impl Outbox {
    pub const EMPTY: Outbox = Outbox { next: core::ptr::null(), left: 0 };

    /// All of `bytes`.
    ///
    /// # Safety
    /// They must stay as they are until all are taken.
    pub unsafe fn of(bytes: &[u8]) -> Outbox {
        Outbox { next: bytes.as_ptr(), left: bytes.len() as u16 }
    }

    /// Takes the next byte, and whether it is the last.
    #[inline(always)]
    pub fn take(&mut self) -> Option<(u8, bool)> {
        self.left = self.left.checked_sub(1)?;
        // SAFETY: by the promise of `of` so many bytes are left from there.
        let byte = unsafe { *self.next };
        self.next = self.next.wrapping_add(1);
        Some((byte, self.left == 0))
    }
}
