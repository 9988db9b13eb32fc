//! The payload of messages.

pub struct Parcel(pub u8);

#[cfg(target_arch = "avr")]
kernel::pool!(Parcel, crate::call::BUFFERS);

#[cfg(not(target_arch = "avr"))]
mod host {
    use std::cell::Cell;

    use kernel::{Pool, Pooled, Slot};

    use super::Parcel;
    use crate::call::BUFFERS;

    std::thread_local! {
        static POOL: Cell<Option<&'static Pool<Parcel>>> = const { Cell::new(None) };
    }

    impl Parcel {
        /// Gives the next run on this thread a new pool.
        pub fn renew_pool() {
            let buffers: &[Slot<Parcel>] = Box::leak(Box::new([const { Slot::new() }; BUFFERS]));
            POOL.set(Some(Box::leak(Box::new(Pool::new(buffers)))));
        }
    }

    // SAFETY: a thread has one pool at a time, and the buffers of each are its own.
    unsafe impl Pooled for Parcel {
        fn pool() -> &'static Pool<Self> {
            POOL.get().expect("the pool was renewed")
        }
    }
}
