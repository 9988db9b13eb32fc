//! The bytes that have been received on a line: a ring that a vector fills and the task empties.
//!
//! A [vector that does not enter the kernel](crate::deferred) stores each byte.

use kernel::{Context, Masked, MaskedCell, Task, Ticks};

/// Slots for bytes. One stays free.
const SLOTS: usize = 32;

/// The mask that wraps an index around the ring.
const AROUND: u8 = {
    assert!(SLOTS.is_power_of_two() && SLOTS <= 128, "the ring is gone around by a mask");
    SLOTS as u8 - 1
};

/// The task is woken at this number of bytes, so that there is less to do at the end of a long frame.
const HALF: u8 = SLOTS as u8 / 2;

/// Within a frame bytes follow each other without a pause. After more ticks than this the rest of it will not
/// come.
const PAUSE: u8 = 1;

/// No slot.
const NOWHERE: u8 = 0xff;

/// What a line carries.
#[doc(hidden)]
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Content {
    /// Frames, each of which ends with a zero. If the end of one was lost, a zero is inserted.
    Frames,
    /// Bytes that may pause anywhere.
    Stream,
}

/// The bytes that have been received on a line, and the line's position in a frame.
#[doc(hidden)]
pub struct Inbox {
    slots: [MaskedCell<u8>; SLOTS],
    /// The slot of the first byte.
    first: MaskedCell<u8>,
    /// The slot that the next byte goes to, always a free one.
    end: MaskedCell<u8>,
    /// The task is woken at this number of bytes, besides at the end of each frame.
    wakes_at: MaskedCell<u8>,
    /// The last byte that was received; 0 between frames.
    last_byte: MaskedCell<u8>,
    /// The low byte of the tick at which it was received. 256 ticks after a frame was cut off, the frame
    /// seems to go on.
    heard_at: MaskedCell<u8>,
    /// The slot in which a frame begins although the one before has no end.
    begins_anew_at: MaskedCell<u8>,
    /// Bytes with framing errors, bytes that found no space, frames that did not fit.
    lost: MaskedCell<u16>,
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
            begins_anew_at: MaskedCell::new(NOWHERE),
            lost: MaskedCell::new(0),
        }
    }

    /// Stores `byte`, which was received at `now`. Returns whether the task is to be woken.
    ///
    /// After a pause within a frame it marks where the new frame begins: the end of the old one was lost, and
    /// the new one must not be taken for the rest of it.
    #[inline(always)]
    pub fn store(&self, masked: &Masked, now: Ticks, byte: u8) -> bool {
        let end = self.end.get(masked);
        if self.is_cut_off(masked, now) {
            self.begins_anew_at.set(masked, end);
        }
        self.heard_at.set(masked, now as u8);
        self.last_byte.set(masked, byte);
        if let Some(slot) = self.slots.get(usize::from(end & AROUND)) {
            slot.set(masked, byte);
        }
        let end = end.wrapping_add(1) & AROUND;
        let first = self.first.get(masked);
        if end == first {
            self.lose(masked);
            return true;
        }
        self.end.set(masked, end);
        let length = end.wrapping_sub(first) & AROUND;
        byte == 0 || length == self.wakes_at.get(masked)
    }

    /// Counts a byte or a frame as lost.
    #[inline(always)]
    pub fn lose(&self, masked: &Masked) {
        self.lost.count(masked);
    }

    /// How many were lost, up to 65,535.
    pub fn lost(&self, masked: &Masked) -> u16 {
        self.lost.get(masked)
    }

    /// Passes the received bytes to `take`, one by one, until it returns that it wants no more. Returns
    /// whether it did.
    #[inline(always)]
    pub fn drain(&self, task: &mut Task, content: Content, mut take: impl FnMut(u8) -> bool) -> bool {
        let (mut first, end, mut anew) = task
            .mask(|masked| (self.first.get(masked), self.end.get(masked), self.begins_anew_at.get(masked)));
        let mut is_last = false;
        // The bytes up to `end` are the task's: vectors add behind them.
        while first != end && !is_last {
            if first == anew {
                anew = NOWHERE;
                task.mask(|masked| self.forget_beginning(masked, first));
                is_last = content == Content::Frames && take(0);
                if is_last {
                    break;
                }
            }
            let Some(slot) = self.slots.get(usize::from(first)) else { break };
            let byte = task.mask(|masked| slot.get(masked));
            first = first.wrapping_add(1) & AROUND;
            is_last = take(byte);
        }
        task.mask(|masked| self.first.set(masked, first));
        is_last
    }

    /// Forgets that a frame begins at `slot`, unless another one has begun since.
    #[inline(always)]
    fn forget_beginning(&self, masked: &Masked, slot: u8) {
        if self.begins_anew_at.get(masked) == slot {
            self.begins_anew_at.set(masked, NOWHERE);
        }
    }

    /// Whether a byte that is received at `now` may belong to a frame that has begun.
    #[inline(always)]
    pub fn is_in_frame(&self, masked: &Masked, now: Ticks) -> bool {
        self.last_byte.get(masked) != 0 && (now as u8).wrapping_sub(self.heard_at.get(masked)) <= PAUSE
    }

    /// Whether a frame has begun, but its rest will not come any more.
    #[inline(always)]
    pub fn is_cut_off(&self, masked: &Masked, now: Ticks) -> bool {
        self.last_byte.get(masked) != 0 && !self.is_in_frame(masked, now)
    }

    /// Wakes the task at the first byte, or otherwise when the ring is half full.
    #[inline(always)]
    pub fn wake_at_first(&self, masked: &Masked, is_on: bool) {
        self.wakes_at.set(masked, if is_on { 1 } else { HALF });
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use kernel::{Priority, Stack, host};
    use std::boxed::Box;
    use std::vec::Vec;

    /// A tick near the end of the clock's range.
    const NOW: Ticks = 65_535;

    /// Lets a task do something with an empty inbox.
    fn with(body: fn(&mut Task, &Inbox)) {
        let stack: &'static Stack<96> = Box::leak(Box::new(Stack::new()));
        host::run_for(
            1,
            move |boot| {
                let run = move |task: &mut Task| {
                    body(task, &Inbox::new());
                    loop {
                        task.delay(kernel::LONGEST);
                    }
                };
                stack.start(boot, Priority::P0, run).expect("the stack is free");
            },
            |_, _| {},
        );
    }

    /// Stores bytes at `now`. Returns for which of them, by their places, the task is woken.
    fn store(task: &mut Task, inbox: &Inbox, now: Ticks, bytes: &[u8]) -> Vec<usize> {
        let store = |byte: &u8| task.mask(|masked| inbox.store(masked, now, *byte));
        bytes.iter().map(store).enumerate().filter_map(|(place, wakes)| wakes.then_some(place)).collect()
    }

    /// Takes bytes up to a zero. Returns them, and whether there was one.
    fn frame(task: &mut Task, inbox: &Inbox, content: Content) -> (Vec<u8>, bool) {
        let mut bytes = Vec::new();
        let is_whole = inbox.drain(task, content, |byte| {
            bytes.push(byte);
            byte == 0
        });
        (bytes, is_whole)
    }

    fn lost(task: &mut Task, inbox: &Inbox) -> u16 {
        task.mask(|masked| inbox.lost(masked))
    }

    #[test]
    fn frames_come_out_one_by_one_however_often_the_ring_goes_round() {
        with(|task, inbox| {
            for round in 0..100 {
                let woken = store(task, inbox, NOW, &[round | 1, 2, 0, 4, 0, 6]);
                assert_eq!(woken, [2, 4]);
                assert_eq!(frame(task, inbox, Content::Frames), (Vec::from([round | 1, 2, 0]), true));
                assert_eq!(frame(task, inbox, Content::Frames), (Vec::from([4, 0]), true));
                assert_eq!(frame(task, inbox, Content::Frames), (Vec::from([6]), false));
                assert_eq!(frame(task, inbox, Content::Frames), (Vec::new(), false));
                assert_eq!(lost(task, inbox), 0);
            }
        });
    }

    #[test]
    fn the_task_is_woken_when_the_ring_is_half_full_or_at_the_first_byte() {
        with(|task, inbox| {
            assert_eq!(store(task, inbox, NOW, &[7; 20]), [usize::from(HALF) - 1]);
            frame(task, inbox, Content::Stream);
            task.mask(|masked| inbox.wake_at_first(masked, true));
            assert_eq!(store(task, inbox, NOW, &[7; 20]), [0]);
            frame(task, inbox, Content::Stream);
            task.mask(|masked| inbox.wake_at_first(masked, false));
            assert_eq!(store(task, inbox, NOW, &[7; 20]), [usize::from(HALF) - 1]);
        });
    }

    #[test]
    fn what_finds_no_space_is_counted_and_leaves_the_rest_as_it_is() {
        with(|task, inbox| {
            let bytes: Vec<u8> = (1..=SLOTS as u8 + 2).collect();
            // The task is also woken for each that is lost.
            assert_eq!(store(task, inbox, NOW, &bytes), [15, 31, 32, 33]);
            assert_eq!(lost(task, inbox), 3);
            assert_eq!(frame(task, inbox, Content::Stream), (bytes[..SLOTS - 1].into(), false));
            store(task, inbox, NOW, &[9, 0]);
            assert_eq!(frame(task, inbox, Content::Stream), (Vec::from([9, 0]), true));
            task.mask(|masked| inbox.lose(masked));
            assert_eq!(lost(task, inbox), 4);
        });
    }

    #[test]
    fn a_frame_is_cut_off_by_a_pause() {
        with(|task, inbox| {
            let state = |task: &mut Task, late: u8| {
                let now = NOW.wrapping_add(late.into());
                task.mask(|masked| (inbox.is_in_frame(masked, now), inbox.is_cut_off(masked, now)))
            };
            assert_eq!(state(task, 0), (false, false), "none has begun");
            store(task, inbox, NOW, &[1]);
            assert_eq!([0, PAUSE].map(|late| state(task, late)), [(true, false); 2]);
            assert_eq!([PAUSE + 1, 255].map(|late| state(task, late)), [(false, true); 2]);
            store(task, inbox, NOW, &[0]);
            assert_eq!([0, PAUSE + 1].map(|late| state(task, late)), [(false, false); 2]);
        });
    }

    #[test]
    fn a_frame_that_follows_one_without_an_end_is_kept_apart() {
        with(|task, inbox| {
            let mut later = NOW;
            for place in 0..2 * SLOTS {
                store(task, inbox, later, &[1, 2]);
                later = later.wrapping_add(Ticks::from(PAUSE) + 1);
                store(task, inbox, later, &[3]);
                // Within the second frame there is no pause.
                store(task, inbox, later.wrapping_add(PAUSE.into()), &[0]);
                assert_eq!(frame(task, inbox, Content::Frames), (Vec::from([1, 2, 0]), true), "{place}");
                assert_eq!(frame(task, inbox, Content::Frames), (Vec::from([3, 0]), true), "{place}");
                assert_eq!(frame(task, inbox, Content::Frames), (Vec::new(), false), "{place}");
                // A byte more, so that frames begin at every slot.
                later = later.wrapping_add(10);
                store(task, inbox, later, &[0]);
                assert_eq!(frame(task, inbox, Content::Frames), (Vec::from([0]), true), "{place}");
            }
        });
    }

    #[test]
    fn a_stream_may_pause_and_what_began_a_frame_is_forgotten_with_its_byte() {
        with(|task, inbox| {
            store(task, inbox, NOW, &[1]);
            store(task, inbox, NOW.wrapping_add(10), &[2, 0]);
            assert_eq!(frame(task, inbox, Content::Stream), (Vec::from([1, 2, 0]), true));
            // Once round the ring: the slot has nothing to say of what lies there now.
            for _ in 0..SLOTS {
                store(task, inbox, NOW, &[0]);
                assert_eq!(frame(task, inbox, Content::Frames), (Vec::from([0]), true));
            }
            task.mask(|masked| {
                inbox.begins_anew_at.set(masked, 5);
                inbox.forget_beginning(masked, 4);
                assert_eq!(inbox.begins_anew_at.get(masked), 5, "another frame has begun since");
            });
        });
    }
}
