//! What a link counts.

/// The counts of one dock, read out of RAM by the console, a debugger or the simulator. All wrap, but
/// `overruns`, which stays at 65,535.
#[repr(C)]
#[derive(Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct LinkCounters {
    /// Frames handed to the line, repetitions and ACKs included.
    pub frames_sent: u16,
    /// Frames that came in whole, whatever became of them.
    pub frames_received: u16,
    /// Repetitions after a time-out.
    pub retries: u16,
    /// Arrivals that are no frame: COBS, CRC, length or content.
    pub errors: u16,
    /// Messages that arrived again: acknowledged again, delivered once.
    pub duplicates: u16,
    /// Messages given up after the last repetition.
    pub gave_up: u16,
    /// Own frames that came back.
    pub reflections: u16,
    /// Messages for a task that this module does not run.
    pub ignored: u16,
    /// Messages that no neighbour may send: for a system task, or to be passed on.
    pub refused: u16,
    /// Messages left unacknowledged for want of a buffer, to be repeated by the neighbour.
    pub no_buffer: u16,
    /// Bytes lost because nobody took them from the line in time.
    pub overruns: u16,
    /// Messages not sent because a newer one took their place.
    pub replaced: u16,
}

impl LinkCounters {
    /// All at 0.
    pub const fn new() -> LinkCounters {
        LinkCounters {
            frames_sent: 0,
            frames_received: 0,
            retries: 0,
            errors: 0,
            duplicates: 0,
            gave_up: 0,
            reflections: 0,
            ignored: 0,
            refused: 0,
            no_buffer: 0,
            overruns: 0,
            replaced: 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::mem::{offset_of, size_of};

    #[test]
    fn readers_of_ram_find_each_count_in_its_place() {
        assert_eq!(size_of::<LinkCounters>(), 24);
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
