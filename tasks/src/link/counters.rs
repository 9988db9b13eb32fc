//! The counts of a link.

use crate::counter::counters;

counters! {
    /// The counts of one dock, read out of RAM by the console, a debugger or the simulator. All wrap, but
    /// `overruns`, which stays at 65,535.
    pub struct LinkCounters {
        /// Frames handed to the line, repetitions and ACKs included.
        frames_sent,
        /// Frames that came in whole, whatever became of them.
        frames_received,
        /// Repetitions after a time-out.
        retries,
        /// Arrivals that are no frame: COBS, CRC, length or content.
        errors,
        /// Messages that arrived again: acknowledged again, delivered once.
        duplicates,
        /// Messages given up after the last repetition.
        gave_up,
        /// Own frames that came back.
        reflections,
        /// Messages for a task that this module does not run, and probes that came in at an open dock.
        ignored,
        /// Messages that no neighbour may send: for a system task, or to be passed on.
        refused,
        /// Messages left unacknowledged for want of a buffer, to be repeated by the neighbour.
        no_buffer,
        /// Bytes lost because they came without a stop bit or were not taken from the line in time, and
        /// frames that were too long: as of the last frame that came in.
        overruns,
        /// Messages not sent because a newer one took their place.
        replaced,
    }
}

/// One of the counts that sender and receiver keep.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Counted {
    FramesSent,
    FramesReceived,
    Retries,
    Errors,
    Duplicates,
    GaveUp,
    Reflections,
    Ignored,
    Refused,
    NoBuffer,
    Replaced,
}

impl<Count> LinkCounters<Count> {
    /// The count of `what`.
    #[inline(always)] // for a constant `what`, nothing of the match is left
    pub fn of(&self, what: Counted) -> &Count {
        match what {
            Counted::FramesSent => &self.frames_sent,
            Counted::FramesReceived => &self.frames_received,
            Counted::Retries => &self.retries,
            Counted::Errors => &self.errors,
            Counted::Duplicates => &self.duplicates,
            Counted::GaveUp => &self.gave_up,
            Counted::Reflections => &self.reflections,
            Counted::Ignored => &self.ignored,
            Counted::Refused => &self.refused,
            Counted::NoBuffer => &self.no_buffer,
            Counted::Replaced => &self.replaced,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::counter::Counter;
    use core::mem::{offset_of, size_of};

    #[test]
    fn readers_of_ram_find_each_count_in_its_place() {
        assert_eq!(size_of::<LinkCounters>(), 24);
        assert_eq!(size_of::<LinkCounters<Counter>>(), 24);
        assert_eq!(
            [
                offset_of!(LinkCounters, frames_sent),
                offset_of!(LinkCounters, frames_received),
                offset_of!(LinkCounters, retries),
                offset_of!(LinkCounters, errors),
                offset_of!(LinkCounters, duplicates),
                offset_of!(LinkCounters, gave_up),
                offset_of!(LinkCounters, reflections),
                offset_of!(LinkCounters, ignored),
                offset_of!(LinkCounters, refused),
                offset_of!(LinkCounters, no_buffer),
                offset_of!(LinkCounters, overruns),
                offset_of!(LinkCounters, replaced),
            ],
            [0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22]
        );
    }
}
