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
