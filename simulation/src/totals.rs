//! The counts of all modules, added up.

use serde::Serialize;
use tasks::bridge::protocol::BridgeCounters;
use tasks::link::counters::LinkCounters;

/// Sums over all docks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LinkTotals {
    /// Frames sent, with probes, repetitions and ACKs.
    pub frames: u64,
    /// Repetitions after a time-out.
    pub retries: u64,
    /// Arrivals that are no frame, and bytes lost on the way in.
    pub errors: u64,
    /// Messages given up.
    pub gave_up: u64,
    /// Messages left unacknowledged because no buffer or place was free.
    pub no_buffer: u64,
}

/// Sums over all bridges between the MCUs of a module.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct BridgeTotals {
    /// Messages that crossed to the other MCU.
    pub messages: u64,
    pub retries: u64,
    pub errors: u64,
    pub gave_up: u64,
    /// Messages lost for want of a buffer.
    pub no_buffer: u64,
}

impl LinkTotals {
    pub fn add(&mut self, counters: &LinkCounters) {
        self.frames += u64::from(counters.frames_sent);
        self.retries += u64::from(counters.retries);
        self.errors += u64::from(counters.errors) + u64::from(counters.overruns);
        self.gave_up += u64::from(counters.gave_up);
        self.no_buffer += u64::from(counters.no_buffer);
    }
}

impl BridgeTotals {
    pub fn add(&mut self, counters: &BridgeCounters) {
        self.messages += u64::from(counters.messages_sent);
        self.retries += u64::from(counters.retries);
        self.errors += u64::from(counters.errors);
        self.gave_up += u64::from(counters.gave_up);
        self.no_buffer += u64::from(counters.no_buffer);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn totals_are_sums_over_all_docks_and_bridges() {
        let mut links = LinkTotals::default();
        for frames_sent in [7, u16::MAX] {
            links.add(&LinkCounters {
                frames_sent,
                frames_received: 900,
                retries: 20,
                errors: 300,
                duplicates: 901,
                gave_up: 4_000,
                reflections: 902,
                ignored: 903,
                refused: 904,
                no_buffer: 50_000,
                overruns: 6_000,
                replaced: 905,
            });
        }
        let frames = 7 + u64::from(u16::MAX);
        let expected = LinkTotals { frames, retries: 40, errors: 12_600, gave_up: 8_000, no_buffer: 100_000 };
        assert_eq!(links, expected);

        let mut bridges = BridgeTotals::default();
        for messages_sent in [7, u16::MAX] {
            bridges.add(&BridgeCounters {
                messages_sent,
                messages_received: 900,
                retries: 20,
                errors: 300,
                gave_up: 4_000,
                ignored: 901,
                no_buffer: 50_000,
                freed: 902,
            });
        }
        let messages = frames;
        let expected =
            BridgeTotals { messages, retries: 40, errors: 600, gave_up: 8_000, no_buffer: 100_000 };
        assert_eq!(bridges, expected);
    }
}
