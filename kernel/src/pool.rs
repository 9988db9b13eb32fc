//! Fixed pools of buffers, and messages: owners of one buffer each.
//!
//! A message is two bytes that own a buffer. It moves from task to task through queues, and its buffer
//! returns to the pool when it is dropped, so it can be neither used twice nor forgotten.

use core::cell::UnsafeCell;
use core::mem::{ManuallyDrop, MaybeUninit};
use core::ops::{Deref, DerefMut};

use crate::arch;
use crate::context::Context;
use crate::masked::{Masked, MaskedCell};

/// A type whose values live in buffers of a pool of its own; see [`pool!`](crate::pool!).
pub trait Pooled: Sized + 'static {
    /// The type's pool.
    fn pool() -> &'static Pool<Self>;
}

/// A buffer: 2 bytes more than its value.
#[repr(C)]
pub struct Slot<T: 'static> {
    /// The next slot in the one list that this slot is in. First, so that assembly needs not know the value's size.
    pub(crate) link: MaskedCell<Option<&'static Slot<T>>>,
    value: UnsafeCell<MaybeUninit<T>>,
}

// SAFETY: `value` is reached only through the one `Message` that owns the slot.
unsafe impl<T: Send + 'static> Sync for Slot<T> {}

impl<T: 'static> Slot<T> {
    /// A free slot.
    pub const fn new() -> Self {
        Slot { link: MaskedCell::new(None), value: UnsafeCell::new(MaybeUninit::uninit()) }
    }
}

impl<T: 'static> Default for Slot<T> {
    fn default() -> Self {
        Self::new()
    }
}

/// Why there is no message: every buffer is in use. The value that was to be sent comes back.
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Exhausted<T>(pub T);

/// A pool of `slots`.
pub struct Pool<T: 'static> {
    slots: &'static [Slot<T>],
    /// Slots that came back.
    free: MaskedCell<Option<&'static Slot<T>>>,
    /// How many slots were ever in use; those behind are free too.
    touched: MaskedCell<u8>,
    exhausted: MaskedCell<u16>,
}

impl<T: Pooled> Pool<T> {
    /// A pool of `slots`, of which it uses the first 255.
    pub const fn new(slots: &'static [Slot<T>]) -> Self {
        Pool {
            slots,
            free: MaskedCell::new(None),
            touched: MaskedCell::new(0),
            exhausted: MaskedCell::new(0),
        }
    }

    /// How often a buffer was asked for and none was free.
    pub fn exhausted(&self, context: &mut impl Context) -> u16 {
        context.mask(|masked| self.exhausted.get(masked))
    }

    /// The most buffers that were ever in use at once.
    pub fn most_used(&self, context: &mut impl Context) -> u8 {
        context.mask(|masked| self.touched.get(masked))
    }

    fn take(&self, masked: &Masked) -> Option<&'static Slot<T>> {
        if let Some(slot) = self.free.get(masked) {
            self.free.set(masked, slot.link.get(masked));
            return Some(slot);
        }
        let touched = self.touched.get(masked);
        let Some(slot) = self.slots.get(touched as usize) else {
            self.exhausted.count(masked);
            return None;
        };
        self.touched.set(masked, touched.checked_add(1)?);
        Some(slot)
    }
}

/// The owner of one buffer with a value in it. Dropping it returns the buffer to its pool.
pub struct Message<T: Pooled> {
    slot: &'static Slot<T>,
}

// SAFETY: a message owns its slot's value as a `Box` would.
unsafe impl<T: Pooled + Send> Send for Message<T> {}

impl<T: Pooled> Message<T> {
    /// Moves `value` into a free buffer.
    ///
    /// # Errors
    /// [`Exhausted`] with the value when none is free; the pool counts it.
    pub fn new(context: &mut impl Context, value: T) -> Result<Self, Exhausted<T>> {
        match context.mask(|masked| T::pool().take(masked)) {
            Some(slot) => {
                // SAFETY: the slot was in the pool, so no message owns it but the one made here.
                unsafe { (*slot.value.get()).write(value) };
                Ok(Message { slot })
            }
            None => Err(Exhausted(value)),
        }
    }

    /// Gives the slot away, with its value in it.
    #[inline(always)]
    pub(crate) fn into_slot(self) -> &'static Slot<T> {
        ManuallyDrop::new(self).slot
    }

    /// # Safety
    /// `slot` must come from [`into_slot`](Self::into_slot), and make one message again.
    #[inline(always)]
    pub(crate) unsafe fn from_slot(slot: &'static Slot<T>) -> Self {
        Message { slot }
    }
}

impl<T: Pooled> Deref for Message<T> {
    type Target = T;

    fn deref(&self) -> &T {
        // SAFETY: the slot holds a value as long as a message owns it.
        unsafe { (*self.slot.value.get()).assume_init_ref() }
    }
}

impl<T: Pooled> DerefMut for Message<T> {
    fn deref_mut(&mut self) -> &mut T {
        // SAFETY: the slot holds a value as long as a message owns it, and this is the one message.
        unsafe { (*self.slot.value.get()).assume_init_mut() }
    }
}

impl<T: Pooled> Drop for Message<T> {
    #[inline(never)]
    fn drop(&mut self) {
        // SAFETY: the message owns the value, and is gone after this.
        unsafe { (*self.slot.value.get()).assume_init_drop() };
        arch::mask_anywhere(|masked| {
            let free = &T::pool().free;
            self.slot.link.set(masked, free.get(masked));
            free.set(masked, Some(self.slot));
        });
    }
}

/// Gives a type its pool.
///
/// ```
/// struct Reading(u16);
/// kernel::pool!(Reading, 8);
/// ```
#[macro_export]
macro_rules! pool {
    ($type:ty, $slots:expr) => {
        impl $crate::Pooled for $type {
            fn pool() -> &'static $crate::Pool<Self> {
                static SLOTS: [$crate::Slot<$type>; $slots] = [const { $crate::Slot::new() }; $slots];
                static POOL: $crate::Pool<$type> = $crate::Pool::new(&SLOTS);
                &POOL
            }
        }
    };
}
