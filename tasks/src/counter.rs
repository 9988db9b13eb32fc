//! Counts that one task keeps and anybody reads. They begin again at 0 after 65,535.

use core::{ptr, slice};

use kernel::{Context, MaskedCell};

/// The counters that `counters` is made of, in order.
///
/// # Safety
/// It is `repr(C)`, and each of its fields is a [`Counter`].
pub(crate) const unsafe fn all<T>(counters: &T) -> &[Counter] {
    // SAFETY: by the caller's promise so many counters lie there, one after the other.
    unsafe { slice::from_raw_parts(ptr::from_ref(counters).cast(), size_of::<T>() / size_of::<Counter>()) }
}

/// A count in two bytes.
#[repr(transparent)]
pub struct Counter(MaskedCell<u16>);

impl Default for Counter {
    fn default() -> Self {
        Self::new()
    }
}

impl Counter {
    /// At 0.
    pub const fn new() -> Self {
        Counter(MaskedCell::new(0))
    }

    /// Counts one more.
    #[inline(always)]
    pub fn count(&self, context: &mut impl Context) {
        context.mask(|masked| self.0.set(masked, self.0.get(masked).wrapping_add(1)));
    }

    /// Takes over a count that is kept elsewhere.
    #[inline(always)]
    pub fn set(&self, context: &mut impl Context, count: u16) {
        context.mask(|masked| self.0.set(masked, count));
    }

    /// What was counted.
    pub fn get(&self, context: &mut impl Context) -> u16 {
        context.mask(|masked| self.0.get(masked))
    }
}
