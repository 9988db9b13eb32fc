//! Follows hormones from module to module.

use std::collections::{HashMap, VecDeque};

use hormone::event::Event;
use hormone::hormone::Data;

use crate::deed::Deed;
use crate::hardware::{MILLISECOND, wire_limit};
use crate::wiring::{Face, Wiring};

/// A hormone that has been handed to a link for longer than this and was not received is lost: more than all
/// repetitions take and less than hormones lie apart.
const LOST_AFTER: u64 = 250 * MILLISECOND;

/// A hormone on its way to the neighbour.
struct Hop {
    data: Data,
    /// When the sending module's HORMONE took it up or generated it.
    taken_up: u64,
    sent: u64,
}

/// What was seen of one module.
#[derive(Clone, Default)]
struct Seen {
    /// When HORMONE took up the last hormone, or generated it.
    taken_up: u64,
    received: Option<Data>,
}

/// Counts, times and orders the hormones between modules.
pub struct Hops {
    under_way: HashMap<Face, VecDeque<Hop>>,
    modules: Vec<Seen>,
    /// Hormones handed to links, one for each dock that one left by.
    pub sent: u64,
    /// Of these, the ones that the neighbour's HORMONE took up.
    pub delivered: u64,
    overtaken: u64,
    /// Hormones that came to a module with the same data as the one before.
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
            overtaken: 0,
            out_of_turn: 0,
            latency_sum: 0,
            latency_max: 0,
            wire_sum: 0,
            now: 0,
        }
    }

    /// Takes in the next deed.
    pub fn take(&mut self, deed: &Deed, wiring: &Wiring) {
        let &Deed { cycle, module, event } = deed;
        self.now = self.now.max(cycle);
        let Some(seen) = self.modules.get_mut(module) else { return };
        match event {
            Event::TopologyChanged(_) | Event::ActionBegun(_) => {}
            Event::HormoneGenerated(_) | Event::MadeGood(_) => seen.taken_up = cycle,
            Event::HormoneSent(dock, data) => {
                let hop = Hop { data, taken_up: seen.taken_up, sent: cycle };
                self.sent += 1;
                self.under_way.entry(Face { module, dock }).or_default().push_back(hop);
            }
            Event::HormoneReceived(dock, data) => {
                seen.taken_up = cycle;
                if seen.received.replace(data) == Some(data) {
                    self.out_of_turn += 1;
                }
                let at = Face { module, dock };
                if let Some(from) = wiring.peer(at) {
                    self.receive(from, at, cycle, data);
                }
            }
        }
    }

    /// A link delivers in order: what was sent before the one that came is lost.
    fn receive(&mut self, from: Face, at: Face, cycle: u64, data: Data) {
        let Some(hops) = self.under_way.get_mut(&from) else { return };
        while let Some(hop) = hops.pop_front() {
            if hop.data == data && hop.sent + LOST_AFTER >= cycle {
                let latency = cycle.saturating_sub(hop.taken_up);
                self.delivered += 1;
                self.latency_sum += latency;
                self.latency_max = self.latency_max.max(latency);
                self.wire_sum += wire_limit(from.dock, at.dock);
                return;
            }
            self.overtaken += 1;
        }
    }

    /// Hormones that did not arrive, and will not.
    pub fn lost(&self) -> u64 {
        let overdue = |hop: &&Hop| hop.sent + LOST_AFTER < self.now;
        self.overtaken + self.under_way.values().flatten().filter(overdue).count() as u64
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
