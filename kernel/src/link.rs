//! Links: what follows a task in its list.

use core::ptr;

use crate::arch;
use crate::critical::{Masked, MaskedCell};

/// The next task, or an end. The end of a wait queue is the semaphore that its tasks wait for; the end of a
/// task that is in no list tells why. A semaphore that no task waits for holds its number of signals in the
/// same form.
///
/// So a debugger that follows the links from a waiting task finds the semaphore. The highest byte tells the
/// kind: it is positive for a task, negative for an end, and 0 for a number. On the AVR this follows from the
/// addresses of RAM, which begin at 0x100 (ATmega128 datasheet, "SRAM Data Memory") and end below 0x8000.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(transparent)]
pub(crate) struct Link(*const ());

// SAFETY: it is only an address. Following it takes a critical section.
unsafe impl Send for Link {}

/// The bit that marks an end.
pub(crate) const END: usize = 1 << (usize::BITS - 1);

impl Link {
    /// The link of a task that has not started, of a proxy waiter in no list, and of an empty ring.
    pub(crate) const NONE: Link = Link(ptr::null());
    /// The link of a task that waits for a time: it is in no list.
    pub(crate) const DELAYED: Link = Link(ptr::without_provenance(0xff << (usize::BITS - 8)));
    /// The link of a task that would be ready if it were not suspended.
    pub(crate) const PARKED: Link = Link(ptr::without_provenance(0xfe << (usize::BITS - 8)));

    /// To the task at this address.
    #[inline(always)]
    pub(crate) fn to_address(task: *const ()) -> Link {
        Link(task.map_addr(|address| address | arch::LINK_MARK))
    }

    /// The address of a task.
    #[inline(always)]
    pub(crate) fn address(self) -> *const () {
        self.0.map_addr(|address| address & !arch::LINK_MARK)
    }

    /// An end that leads to the object at this address.
    #[inline(always)]
    pub(crate) fn end_at(object: *const ()) -> Link {
        Link(ptr::with_exposed_provenance(object.expose_provenance() | END))
    }

    /// The address of the object that this end leads to, if it leads to one.
    pub(crate) fn object(self) -> Option<*const ()> {
        let is_object = self.kind() < 0 && self != Link::DELAYED && self != Link::PARKED;
        is_object.then(|| ptr::with_exposed_provenance(self.0.addr() & !END))
    }

    /// A number of signals.
    #[inline(always)]
    pub(crate) const fn signals(signals: u8) -> Link {
        Link(ptr::without_provenance(signals as usize))
    }

    /// The highest byte. No other link has that of [`DELAYED`](Self::DELAYED) or [`PARKED`](Self::PARKED).
    #[inline(always)]
    pub(crate) fn kind(self) -> i8 {
        (self.0.addr() >> (usize::BITS - 8)) as i8
    }
}

/// A cell for a link. The most frequent calls access only one of its bytes.
#[repr(transparent)]
pub(crate) struct LinkCell(MaskedCell<Link>);

const _: () = assert!(cfg!(target_endian = "little"), "the first byte of a link is its lowest");

impl LinkCell {
    pub(crate) const fn new(link: Link) -> Self {
        LinkCell(MaskedCell::new(link))
    }

    #[inline(always)]
    pub(crate) fn get(&self, masked: &Masked) -> Link {
        self.0.get(masked)
    }

    #[inline(always)]
    pub(crate) fn set(&self, masked: &Masked, link: Link) {
        self.0.set(masked, link);
    }

    #[inline(always)]
    pub(crate) fn replace(&self, masked: &Masked, link: Link) -> Link {
        self.0.replace(masked, link)
    }

    #[inline(always)]
    fn byte<const INDEX: usize>(&self) -> &MaskedCell<u8> {
        const { assert!(INDEX < size_of::<Link>()) };
        // SAFETY: one of the bytes of the cell, each of which can be accessed as a cell of a byte.
        unsafe { &*(&raw const self.0).cast::<MaskedCell<u8>>().add(INDEX) }
    }

    /// The highest byte.
    #[inline(always)]
    pub(crate) fn kind(&self, masked: &Masked) -> i8 {
        self.byte::<{ size_of::<Link>() - 1 }>().get(masked) as i8
    }

    /// The lowest byte: the number of signals, if this is a number.
    #[inline(always)]
    pub(crate) fn signals(&self, masked: &Masked) -> u8 {
        self.byte::<0>().get(masked)
    }

    /// Changes a number of signals to another.
    #[inline(always)]
    pub(crate) fn set_signals(&self, masked: &Masked, signals: u8) {
        self.byte::<0>().set(masked, signals);
    }
}
