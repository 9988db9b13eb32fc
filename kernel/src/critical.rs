//! Shared state of the kernel: cells that can be accessed only while interrupts are masked.

use core::cell::Cell;
use core::marker::PhantomData;

/// Proof that interrupts are masked, so that nothing else touches a [`MaskedCell`].
///
/// Neither `Send` nor `Sync`: the proof holds for the code that masked them, nowhere else.
pub struct Masked {
    _not_send: PhantomData<*mut ()>,
}

impl Masked {
    /// # Safety
    /// Interrupts must stay masked for as long as the result lives.
    #[inline(always)]
    pub(crate) unsafe fn assume() -> Masked {
        Masked { _not_send: PhantomData }
    }
}

/// A value read and written only while interrupts are masked.
///
/// A static cell can hand its value from one task to another, so the value must be `Send`:
///
/// ```compile_fail,E0277
/// # use kernel::MaskedCell;
/// # use std::cell::Cell;
/// // error: `Cell<u32>` cannot be shared between threads safely
/// static SHARED: MaskedCell<Option<&'static Cell<u32>>> = MaskedCell::new(None);
/// ```
#[repr(transparent)]
pub struct MaskedCell<T>(Cell<T>);

// SAFETY: every access needs a `Masked`, which exists only where interrupts are masked; the MCU has one
// core, and the host port runs one kernel at a time, so accesses never overlap.
unsafe impl<T: Send> Sync for MaskedCell<T> {}

impl<T> MaskedCell<T> {
    /// A cell that holds `value`.
    pub const fn new(value: T) -> Self {
        MaskedCell(Cell::new(value))
    }

    /// Stores `value` and drops the old one.
    #[inline(always)]
    pub fn set(&self, _: &Masked, value: T) {
        self.0.set(value);
    }

    /// Stores `value`, and returns the old one. So a handler can take out a value that was handed to it,
    /// `Copy` or not:
    ///
    /// ```
    /// use kernel::{Context, Interrupt, MaskedCell, host};
    ///
    /// /// Has one owner, as a peripheral does.
    /// struct Port(u8);
    /// static PORT: MaskedCell<Option<Port>> = MaskedCell::new(None);
    ///
    /// fn handler(interrupt: &mut Interrupt) {
    ///     let Some(mut port) = interrupt.mask(|masked| PORT.replace(masked, None)) else { return };
    ///     port.0 += 1;
    ///     interrupt.mask(|masked| PORT.set(masked, Some(port)));
    /// }
    ///
    /// let port = Port(0);
    /// host::run_for(
    ///     2,
    ///     |boot| boot.mask(|masked| PORT.set(masked, Some(port))),
    ///     |interrupt, tick| {
    ///         handler(interrupt);
    ///         let port = interrupt.mask(|masked| PORT.replace(masked, None));
    ///         assert_eq!(port.map(|port| port.0), [None, Some(1), None][tick as usize]);
    ///     },
    /// );
    /// ```
    #[inline(always)]
    pub fn replace(&self, _: &Masked, value: T) -> T {
        self.0.replace(value)
    }
}

impl<T: Copy> MaskedCell<T> {
    /// A copy of the value.
    #[inline(always)]
    pub fn get(&self, _: &Masked) -> T {
        self.0.get()
    }

    /// Stores `value`. Unlike [`set`](Self::set) it does not look at the old one, which may be a reference to
    /// what is gone.
    #[inline(always)]
    pub(crate) fn overwrite(&self, _: &Masked, value: T) {
        // SAFETY: nothing else accesses the cell while interrupts are masked, and a `Copy` type has no drop.
        unsafe { self.0.as_ptr().write(value) }
    }
}

/// A [`MaskedCell`] that only the kernel changes, and others may read. The assembly of vectors needs some of
/// the kernel's statics to be public; in a plain `MaskedCell` a program could change them.
#[repr(transparent)]
pub struct KernelCell<T>(MaskedCell<T>);

impl<T: Copy> KernelCell<T> {
    pub(crate) const fn new(value: T) -> Self {
        KernelCell(MaskedCell::new(value))
    }

    #[inline(always)]
    pub(crate) fn set(&self, masked: &Masked, value: T) {
        self.0.set(masked, value);
    }

    /// A copy of the value.
    #[inline(always)]
    pub fn get(&self, masked: &Masked) -> T {
        self.0.get(masked)
    }
}

impl MaskedCell<u16> {
    /// Increments the count, which saturates at `u16::MAX`.
    #[inline(always)]
    pub fn count(&self, _: &Masked) {
        if let Some(count) = self.0.get().checked_add(1) {
            self.0.set(count);
        }
    }
}
