//! Follows hormones from module to module.

use std::collections::{HashMap, VecDeque};
use std::ops::Range;

use hormone::event::Event;
use hormone::hormone::Data;

use crate::hardware::{MILLISECOND, wire_limit};
use crate::trace_event::TraceEvent;
use crate::wiring::{Face, Wiring};

/// A hormone that was handed to a link longer ago than this, in cycles, and was not received is lost. This is
/// more than all repetitions take, and less than hormones lie apart.
pub const LOST_AFTER: u64 = 250 * MILLISECOND;

/// A hormone on its way to the neighbour.
struct Hop {
    data: Data,
    /// The neighbour's module, if there is one.
    to: Option<usize>,
    /// When the sending module's HORMONE took it up or generated it.
    taken_up: u64,
    sent: u64,
}

/// A hormone that has come to where it was sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arrival {
    /// The dock that it left by.
    pub from: Face,
    /// When it was handed to the link there, in cycles.
    pub sent: u64,
}

/// Observations of one module.
#[derive(Clone, Default)]
struct Seen {
    /// When HORMONE took up the last hormone, or generated it.
    taken_up: u64,
    received: Option<Data>,
    /// The last span in which an event concerned it.
    disturbed: Range<u64>,
}

/// Counts, times and orders the hormones between modules.
pub struct Hops {
    under_way: HashMap<Face, VecDeque<Hop>>,
    modules: Vec<Seen>,
    /// Hormones handed to links, one for each dock that one left by.
    pub sent: u64,
    /// The hormones among `sent` that the neighbour's HORMONE took up.
    pub delivered: u64,
    /// The hormones among `sent` that came, and were no news.
    pub dropped: u64,
    /// Hormones that were lost, but for those that are still thought to be under way.
    lost_before: u64,
    /// The hormones among `lost_before` for which there is a cause.
    excused: u64,
    /// From when until when lines lost or changed what went over them, the last time.
    noisy: Range<u64>,
    /// Hormones that a module took up with the same data as the one before.
    pub out_of_turn: u64,
    latency_sum: u64,
    latency_max: u64,
    wire_sum: u64,
    now: u64,
}

impl Hops {
    /// Nothing seen yet of so many modules.
    pub fn new(modules: usize) -> Self {
        Hops {
            under_way: HashMap::new(),
            modules: vec![Seen::default(); modules],
            sent: 0,
            delivered: 0,
            dropped: 0,
            lost_before: 0,
            excused: 0,
            noisy: 0..0,
            out_of_turn: 0,
            latency_sum: 0,
            latency_max: 0,
            wire_sum: 0,
            now: 0,
        }
    }

    /// Takes in the next trace event. Returns the hormone that came by it, if one did.
    pub fn take(&mut self, trace_event: &TraceEvent, wiring: &Wiring) -> Option<Arrival> {
        let &TraceEvent { cycle, module, event } = trace_event;
        self.now = self.now.max(cycle);
        let seen = self.modules.get_mut(module)?;
        match event {
            Event::TopologyChanged(_) | Event::ActionBegun(_) => {}
            Event::HormoneDropped(dock) => {
                return self.drop(wiring.peer(Face { module, dock })?, cycle);
            }
            Event::HormoneGenerated(_) | Event::MadeGood(_) => seen.taken_up = cycle,
            Event::HormoneSent(dock, data) => {
                let from = Face { module, dock };
                let to = wiring.peer(from).map(|peer| peer.module);
                let hop = Hop { data, to, taken_up: seen.taken_up, sent: cycle };
                self.sent += 1;
                self.under_way.entry(from).or_default().push_back(hop);
            }
            Event::HormoneReceived(dock, data) => {
                seen.taken_up = cycle;
                if seen.received.replace(data) == Some(data) {
                    self.out_of_turn += 1;
                }
                let at = Face { module, dock };
                return self.receive(wiring.peer(at)?, at, cycle, data);
            }
        }
        None
    }

    /// A link delivers in order: hormones that were sent before the one that came are lost.
    fn receive(&mut self, from: Face, at: Face, cycle: u64, data: Data) -> Option<Arrival> {
        while let Some(hop) = self.under_way.get_mut(&from).and_then(VecDeque::pop_front) {
            if hop.data == data && hop.sent + LOST_AFTER >= cycle {
                let latency = cycle.saturating_sub(hop.taken_up);
                self.delivered += 1;
                self.latency_sum += latency;
                self.latency_max = self.latency_max.max(latency);
                self.wire_sum += wire_limit(from.dock, at.dock);
                return Some(Arrival { from, sent: hop.sent });
            }
            self.lost_before += 1;
            self.excused += u64::from(self.is_excused(from.module, &hop));
        }
        None
    }

    /// The next one that came by this link was dropped.
    fn drop(&mut self, from: Face, cycle: u64) -> Option<Arrival> {
        while let Some(hop) = self.under_way.get_mut(&from).and_then(VecDeque::pop_front) {
            if hop.sent + LOST_AFTER >= cycle {
                self.dropped += 1;
                return Some(Arrival { from, sent: hop.sent });
            }
            self.lost_before += 1;
            self.excused += u64::from(self.is_excused(from.module, &hop));
        }
        None
    }

    /// Something happened at `now` that concerns these modules, each until its time.
    pub fn disturbed(&mut self, concerned: &[(usize, u64)], now: u64) {
        self.settle(now);
        for &(module, until) in concerned {
            self.modules[module].disturbed = now..until;
        }
    }

    /// From `now` on there are lines that lose or change what goes over them, or none.
    pub fn disturb_lines(&mut self, are_noisy: bool, now: u64) {
        self.settle(now);
        let start = if self.noisy.end == u64::MAX { self.noisy.start } else { now };
        self.noisy = if are_noisy { start..u64::MAX } else { self.noisy.start..self.noisy.end.min(now) };
    }

    /// Counts the hormones that are lost by `now`, while their possible causes are known.
    fn settle(&mut self, now: u64) {
        self.now = self.now.max(now);
        let lost: Vec<bool> = self.overdue().map(|(from, hop)| self.is_excused(from, hop)).collect();
        self.lost_before += lost.len() as u64;
        self.excused += lost.into_iter().filter(|is_excused| *is_excused).count() as u64;
        let now = self.now;
        self.under_way.values_mut().for_each(|hops| hops.retain(|hop| hop.sent + LOST_AFTER >= now));
    }

    /// Hormones that did not arrive, and will not.
    pub fn lost(&self) -> u64 {
        self.lost_before + self.overdue().count() as u64
    }

    /// The [lost](Self::lost) hormones that were lost though all was well: no line lost or changed bytes, and
    /// nothing happened to the sender or to the receiver.
    pub fn lost_without_cause(&self) -> u64 {
        let excused = self.overdue().filter(|(from, hop)| self.is_excused(*from, hop)).count() as u64;
        self.lost() - self.excused - excused
    }

    /// The hormones that are under way for too long, and from which module.
    fn overdue(&self) -> impl Iterator<Item = (usize, &Hop)> {
        let all = self.under_way.iter().flat_map(|(from, hops)| hops.iter().map(|hop| (from.module, hop)));
        all.filter(|(_, hop)| hop.sent + LOST_AFTER < self.now)
    }

    fn is_excused(&self, from: usize, hop: &Hop) -> bool {
        let is_within = |span: &Range<u64>| hop.sent <= span.end && span.start <= hop.sent + LOST_AFTER;
        let is_disturbed = |module: usize| is_within(&self.modules[module].disturbed);
        hop.to.is_none_or(is_disturbed) || is_disturbed(from) || is_within(&self.noisy)
    }

    /// The hop latency's mean and maximum, in cycles: from one module's HORMONE taking a hormone up, or
    /// generating it, to the next module's. `None` before the first.
    pub fn latency(&self) -> Option<(f64, u64)> {
        let mean = self.latency_sum as f64 / self.delivered as f64;
        (self.delivered > 0).then_some((mean, self.latency_max))
    }

    /// The mean hop latency over the mean of the limits that the wires set. `None` before the first.
    pub fn latency_over_wire(&self) -> Option<f64> {
        (self.delivered > 0).then(|| self.latency_sum as f64 / self.wire_sum as f64)
    }
}
