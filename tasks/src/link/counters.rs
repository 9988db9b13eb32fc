//! What a link counts.

use kernel::Task;

use crate::counter::Counter;

/// The counts of one dock, read out of RAM by the console, a debugger or the simulator. All wrap, but
/// `overruns`, which stays at 65,535.
#[repr(C)]
#[derive(Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct LinkCounters<Count = u16> {
    /// Frames handed to the line, repetitions and ACKs included.
    pub frames_sent: Count,
    /// Frames that came in whole, whatever became of them.
    pub frames_received: Count,
    /// Repetitions after a time-out.
    pub retries: Count,
    /// Arrivals that are no frame: COBS, CRC, length or content.
    pub errors: Count,
    /// Messages that arrived again: acknowledged again, delivered once.
    pub duplicates: Count,
    /// Messages given up after the last repetition.
    pub gave_up: Count,
    /// Own frames that came back.
    pub reflections: Count,
    /// Messages for a task that this module does not run.
    pub ignored: Count,
    /// Messages that no neighbour may send: for a system task, or to be passed on.
    pub refused: Count,
    /// Messages left unacknowledged for want of a buffer, to be repeated by the neighbour.
    pub no_buffer: Count,
    /// Bytes lost because nobody took them from the line in time.
    pub overruns: Count,
    /// Messages not sent because a newer one took their place.
    pub replaced: Count,
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
    /// The count of this.
    #[inline(always)] // where it is known of what, nothing of this is left
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

    /// What `read` makes of each count.
    #[inline(always)]
    pub fn map<Other>(&self, mut read: impl FnMut(&Count) -> Other) -> LinkCounters<Other> {
        LinkCounters {
            frames_sent: read(&self.frames_sent),
            frames_received: read(&self.frames_received),
            retries: read(&self.retries),
            errors: read(&self.errors),
            duplicates: read(&self.duplicates),
            gave_up: read(&self.gave_up),
            reflections: read(&self.reflections),
            ignored: read(&self.ignored),
            refused: read(&self.refused),
            no_buffer: read(&self.no_buffer),
            overruns: read(&self.overruns),
            replaced: read(&self.replaced),
        }
    }
}

impl LinkCounters<Counter> {
    /// All at 0.
    pub const fn new() -> Self {
        LinkCounters {
            frames_sent: Counter::new(),
            frames_received: Counter::new(),
            retries: Counter::new(),
            errors: Counter::new(),
            duplicates: Counter::new(),
            gave_up: Counter::new(),
            reflections: Counter::new(),
            ignored: Counter::new(),
            refused: Counter::new(),
            no_buffer: Counter::new(),
            overruns: Counter::new(),
            replaced: Counter::new(),
        }
    }

    /// What was counted.
    pub fn read(&self, task: &mut Task) -> LinkCounters {
        self.map(|count| count.get(task))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
