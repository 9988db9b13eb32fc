//! Fixed pools of buffers, and messages: owners of one buffer each.
//!
//! A message is two bytes that own a buffer. It moves from task to task through queues, and its buffer
//! returns to the pool when the message is dropped. So no buffer has two owners, and none has to be freed by
//! hand.

use core::cell::UnsafeCell;
use core::mem::{ManuallyDrop, MaybeUninit};
use core::ops::{Deref, DerefMut};

use crate::arch;
use crate::context::Context;
use crate::critical::{Masked, MaskedCell};

/// A type whose values live in buffers of a pool of its own; see [`pool!`](crate::pool!), which implements
/// it.
///
/// # Safety
/// `pool` must return the same pool each time, and no other pool may have its slots: a slot in two pools
/// would make two messages that own one buffer.
///
/// ```compile_fail,E0200
/// # use kernel::{Pool, Pooled, Slot};
/// struct Reading(u16);
/// static SLOTS: [Slot<Reading>; 1] = [Slot::new()];
/// static POOL: Pool<Reading> = Pool::new(&SLOTS);
/// impl Pooled for Reading { // error: the trait `Pooled` requires an `unsafe impl` declaration
///     fn pool() -> &'static Pool<Reading> { &POOL }
/// }
/// ```
pub unsafe trait Pooled: Sized + 'static {
    /// The type's pool.
    fn pool() -> &'static Pool<Self>;
}

/// A buffer: 2 bytes more than its value.
pub struct Slot<T: 'static> {
    /// The next slot in the one list that this slot is in.
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
#[derive(Debug)]
pub struct Exhausted<T>(pub T);

/// A pool of `slots`.
pub struct Pool<T: 'static> {
    slots: &'static [Slot<T>],
    /// Slots that were returned.
    free: MaskedCell<Option<&'static Slot<T>>>,
    /// How many slots have ever been in use. The slots behind these are free, too.
    touched: MaskedCell<u8>,
    exhausted: MaskedCell<u16>,
}

impl<T: Pooled> Pool<T> {
    /// A pool of `slots`, at most 255: with more, a static pool does not compile.
    ///
    /// ```compile_fail,E0080
    /// struct Tiny(u8);
    /// kernel::pool!(Tiny, 256); // error: a pool has at most 255 slots
    /// ```
    pub const fn new(slots: &'static [Slot<T>]) -> Self {
        assert!(slots.len() <= 255, "a pool has at most 255 slots");
        Pool {
            slots,
            free: MaskedCell::new(None),
            touched: MaskedCell::new(0),
            exhausted: MaskedCell::new(0),
        }
    }

    /// How often no buffer was free when one was needed.
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
        self.touched.set(masked, touched + 1);
        Some(slot)
    }
}

/// The owner of one buffer with a value in it. Dropping it returns the buffer to its pool.
///
/// Tasks that share a message share its value, so the value must be `Sync`:
///
/// ```compile_fail,E0277
/// # use kernel::Message;
/// # use std::cell::Cell;
/// struct Reading(Cell<u16>);
/// kernel::pool!(Reading, 8);
/// fn share<T: Sync>() {}
/// share::<Message<Reading>>(); // error: `Cell<u16>` cannot be shared between threads safely
/// ```
pub struct Message<T: Pooled> {
    slot: &'static Slot<T>,
}

// SAFETY: a message owns its slot's value as a `Box` would.
unsafe impl<T: Pooled + Send> Send for Message<T> {}
// SAFETY: a shared message lends its value as a shared `Box` would. `Slot` is `Sync` if the value is `Send`,
// which is not enough here.
unsafe impl<T: Pooled + Sync> Sync for Message<T> {}

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

    /// Gives up the slot, with its value in it.
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
        arch::critical(|masked| {
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
///
/// struct Parcel(u8);
/// const SLOTS: usize = 4;
/// kernel::pool!(Parcel, SLOTS);
/// ```
#[macro_export]
macro_rules! pool {
    ($type:ty, $slots:expr) => {
        // SAFETY: the one pool over these slots, which have no other name.
        unsafe impl $crate::Pooled for $type {
            fn pool() -> &'static $crate::Pool<Self> {
                // `$slots` sees these names, so a constant of the program must not have them.
                static __SLOTS: [$crate::Slot<$type>; $slots] = [const { $crate::Slot::new() }; $slots];
                static __POOL: $crate::Pool<$type> = $crate::Pool::new(&__SLOTS);
                &__POOL
            }
        }
    };
}
