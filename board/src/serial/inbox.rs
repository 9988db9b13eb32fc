//! What has come on a line: a ring of bytes that a vector fills, and the task empties.
//!
//! Where the vector is in the middle of a frame it enters no kernel: it stores the byte, by [`store!`](crate::store!), and is done.

use core::mem::offset_of;

use kernel::{Masked, MaskedCell, Ticks};

/// Slots for bytes. One stays free.
const SLOTS: usize = 32;

/// What a place in the ring is masked with, to go around.
#[doc(hidden)]
pub const AROUND: u8 = {
    assert!(SLOTS.is_power_of_two() && SLOTS <= 128, "the ring is gone around by a mask");
    SLOTS as u8 - 1
};

/// When so many bytes are there the task takes them, so that there is less to do at the end of a long frame.
const HALF: u8 = SLOTS as u8 / 2;

/// Within a frame bytes follow each other without a pause. After more ticks than this the rest of it is not coming.
#[doc(hidden)]
pub const PAUSE: u8 = 1;

/// The bytes that have come on a line, and where in a frame it is.
#[doc(hidden)]
#[repr(C)]
pub struct Inbox {
    slots: [MaskedCell<u8>; SLOTS],
    /// The slot of the first byte.
    first: MaskedCell<u8>,
    /// The slot that the next byte goes to, always a free one.
    end: MaskedCell<u8>,
    /// At so many bytes the task is woken, besides at the end of each frame.
    wakes_at: MaskedCell<u8>,
    /// The byte that came last; 0 between frames.
    last_byte: MaskedCell<u8>,
    /// When it came: the low byte of the tick. 256 ticks after a frame was cut off it seems to go on.
    heard_at: MaskedCell<u8>,
    /// Bytes with framing errors, bytes that found no space, frames that did not fit.
    lost: MaskedCell<u16>,
}

/// Offsets for [`store!`](crate::store!).
#[doc(hidden)]
pub mod offset {
    use super::{Inbox, offset_of};

    pub const FIRST: usize = offset_of!(Inbox, first);
    pub const END: usize = offset_of!(Inbox, end);
    pub const WAKES_AT: usize = offset_of!(Inbox, wakes_at);
    pub const LAST_BYTE: usize = offset_of!(Inbox, last_byte);
    pub const HEARD_AT: usize = offset_of!(Inbox, heard_at);
    pub const LOST: usize = offset_of!(Inbox, lost);
}

impl Inbox {
    pub const fn new() -> Self {
        Inbox {
            slots: [const { MaskedCell::new(0) }; SLOTS],
            first: MaskedCell::new(0),
            end: MaskedCell::new(0),
            wakes_at: MaskedCell::new(HALF),
            last_byte: MaskedCell::new(0),
            heard_at: MaskedCell::new(0),
            lost: MaskedCell::new(0),
        }
    }

    /// Stores `byte`, which has come at `now`, as [`store!`](crate::store!) does. Returns whether the task is to be woken.
    #[inline(always)]
    pub fn store(&self, masked: &Masked, now: Ticks, byte: u8) -> bool {
        self.heard_at.set(masked, now as u8);
        self.last_byte.set(masked, byte);
        let (first, end) = (self.first.get(masked), self.end.get(masked));
        if let Some(slot) = self.slots.get(usize::from(end)) {
            slot.set(masked, byte);
        }
        let end = end.wrapping_add(1) & AROUND;
        if end == first {
            self.lose(masked);
            return true;
        }
        self.end.set(masked, end);
        let length = end.wrapping_sub(first) & AROUND;
        byte == 0 || length == self.wakes_at.get(masked)
    }

    /// A byte or a frame is lost.
    #[inline(always)]
    pub fn lose(&self, masked: &Masked) {
        self.lost.count(masked);
    }

    /// How many were lost, up to 65,535.
    pub fn lost(&self, masked: &Masked) -> u16 {
        self.lost.get(masked)
    }

    /// Takes the first byte.
    #[inline(always)]
    pub fn take(&self, masked: &Masked) -> Option<u8> {
        let first = self.first.get(masked);
        if first == self.end.get(masked) {
            return None;
        }
        self.first.set(masked, first.wrapping_add(1) & AROUND);
        self.slots.get(usize::from(first)).map(|slot| slot.get(masked))
    }

    /// Whether a byte that comes `now` may belong to a frame that has begun.
    #[inline(always)]
    pub fn is_in_frame(&self, masked: &Masked, now: Ticks) -> bool {
        self.last_byte.get(masked) != 0 && (now as u8).wrapping_sub(self.heard_at.get(masked)) <= PAUSE
    }

    /// Whether a frame has begun whose rest does not come any more.
    #[inline(always)]
    pub fn is_cut_off(&self, masked: &Masked, now: Ticks) -> bool {
        self.last_byte.get(masked) != 0 && !self.is_in_frame(masked, now)
    }

    /// Forgets that a frame has begun.
    #[inline(always)]
    pub fn forget_frame(&self, masked: &Masked) {
        self.last_byte.set(masked, 0);
    }

    /// Has the task woken by the first byte, or else by the first half of a ring.
    #[inline(always)]
    pub fn wake_at_first(&self, masked: &Masked, is_on: bool) {
        self.wakes_at.set(masked, if is_on { 1 } else { HALF });
    }
}

/// Assembly that puts the low byte of the tick into r25: 5 cycles. It changes r24.
#[doc(hidden)]
#[macro_export]
macro_rules! tick {
    () => {
        concat!(
            "lds r25, {kernel}+{tick}\n", // 2
            "lds r24, {ticks_left}\n",    // 2
            "sub r25, r24\n",             // 1
        )
    };
}

/// The same, and clears C if a byte that comes now comes after a pause: 10 cycles. It changes r24.
#[doc(hidden)]
#[macro_export]
macro_rules! is_in_time {
    () => {
        concat!(
            $crate::tick!(),                 // 5
            "lds r24, {inbox}+{heard_at}\n", // 2
            "sub r24, r25\n",                // 1: less the ticks since
            "subi r24, -{pause}\n",          // 1: so many ticks more may have passed
            "cpi r24, {pause}+1\n",          // 1
        )
    };
}

/// Assembly that stores the byte in r24, which has come at the tick whose low byte is in r25, into the inbox `{inbox}`, as
/// [`Inbox::store`] does: 28 cycles. It changes r25 and Z. It goes on at the label 8 if the task is to be woken, and at 9 if
/// there was no space: that is still to be [counted](crate::lose!), and to wake the task.
#[doc(hidden)]
#[macro_export]
macro_rules! store {
    () => {
        concat!(
            "sts {inbox}+{heard_at}, r25\n",  // 2
            "sts {inbox}+{last_byte}, r24\n", // 2
            "lds r25, {inbox}+{end}\n",       // 2: the slot
            "mov r30, r25\n",                 // 1
            "ldi r31, 0\n",                   // 1
            "subi r30, lo8(-({inbox}))\n",    // 1: Z = its address
            "sbci r31, hi8(-({inbox}))\n",    // 1
            "st Z, r24\n",                    // 2
            "inc r25\n",                      // 1: the next slot
            "andi r25, {around}\n",           // 1
            "lds r30, {inbox}+{first}\n",     // 2
            "cp r25, r30\n",                  // 1
            "breq 9f\n",                      // 1
            "sts {inbox}+{end}, r25\n",       // 2
            "tst r24\n",                      // 1: the end of a frame?
            "breq 8f\n",                      // 1
            "sub r25, r30\n",                 // 1: the number of bytes
            "andi r25, {around}\n",           // 1
            "lds r30, {inbox}+{wakes_at}\n",  // 2
            "cp r25, r30\n",                  // 1
            "breq 8f\n",                      // 1
        )
    };
}

/// Assembly that counts a byte that is lost, as [`Inbox::lose`] does. It changes Z.
#[doc(hidden)]
#[macro_export]
macro_rules! lose {
    () => {
        concat!(
            "lds r30, {inbox}+{lost}\n",   // 2
            "lds r31, {inbox}+{lost}+1\n", // 2
            "adiw r30, 1\n",               // 2
            "breq 1f\n",                   // 1: it stays at the most
            "sts {inbox}+{lost}, r30\n",   // 2
            "sts {inbox}+{lost}+1, r31\n", // 2
            "1:\n",
        )
    };
}
