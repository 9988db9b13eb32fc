//! Values that vectors and tasks share, lent in place. A [`kernel::MaskedCell`] copies its value in and out,
//! for which a vector has no time.

use kernel::Masked;

/// A value that is lent only while interrupts are masked.
pub struct Guarded<T>(T);

// SAFETY: only `get` gives access to the value, and its result lives no longer than the proof that interrupts
// are masked. The MCU has one core, so nothing else runs meanwhile.
unsafe impl<T: Send> Sync for Guarded<T> {}

impl<T> Guarded<T> {
    pub const fn new(value: T) -> Self {
        Guarded(value)
    }

    /// The value, for as long as interrupts are masked.
    #[inline(always)]
    pub fn get<'a>(&'a self, _: &'a Masked) -> &'a T {
        &self.0
    }
}
