//! Follows the hormones from module to module by the events that the behaviours tell of.

use std::collections::{HashMap, VecDeque};

use hormone::event::Event as Behaviour;
use hormone::hormone::Data;
use simavr_harness::{CLOCK_HZ, Controller, Event, Face, Robot};

/// A hormone that has been handed to a link for longer than this and was not received is lost, in cycles: 250 ms, more
/// than all repetitions take and less than hormones lie apart.
const LOST_AFTER: u64 = CLOCK_HZ as u64 / 4;

/// A hormone on its way to the neighbour.
struct Hop {
    data: Data,
    /// When the sending module's HORMONE took it up or generated it.
    taken_up: u64,
    sent: u64,
}

/// What was seen of one module.
#[derive(Default)]
struct Seen {
    /// When HORMONE took up the last hormone, or generated it.
    taken_up: u64,
    received: Option<Data>,
    topology_changes: u64,
}

/// Counts, times and orders what the behaviours did.
pub struct Observer {
    /// By sending face, the receiving one.
    wires: HashMap<Face, Face>,
    under_way: HashMap<Face, VecDeque<Hop>>,
    modules: Vec<Seen>,
    pub sent: u64,
    pub delivered: u64,
    skipped: u64,
    /// Hormones that came to a module with the same data as the one before.
    pub out_of_turn: u64,
    latencies: Latencies,
    now: u64,
}

/// Hop latencies, in cycles.
#[derive(Default)]
struct Latencies {
    number: u64,
    sum: u64,
    longest: u64,
}

impl Observer {
    pub fn new(robot: &Robot) -> Self {
        let faces =
            (0..robot.modules()).flat_map(|module| tasks::dock::Dock::ALL.map(|dock| Face { module, dock }));
        Observer {
            wires: faces.filter_map(|face| Some((face, robot.neighbour(face)?))).collect(),
            under_way: HashMap::new(),
            modules: (0..robot.modules()).map(|_| Seen::default()).collect(),
            sent: 0,
            delivered: 0,
            skipped: 0,
            out_of_turn: 0,
            latencies: Latencies::default(),
            now: 0,
        }
    }

    /// Takes in what happened, in order.
    pub fn take(&mut self, events: &[Event]) {
        for event in events {
            self.now = self.now.max(event.cycle);
            if event.controller == Controller::Master
                && let Some(behaviour) = Behaviour::from_byte(event.value)
            {
                self.see(event.module, event.cycle, behaviour);
            }
        }
    }

    fn see(&mut self, module: usize, cycle: u64, behaviour: Behaviour) {
        let Some(seen) = self.modules.get_mut(module) else { return };
        match behaviour {
            Behaviour::TopologyChanged(_) => seen.topology_changes += 1,
            Behaviour::HormoneGenerated(_) | Behaviour::MadeGood(_) => seen.taken_up = cycle,
            Behaviour::ActionBegun(_) => {}
            Behaviour::HormoneSent(dock, data) => {
                let hop = Hop { data, taken_up: seen.taken_up, sent: cycle };
                self.sent += 1;
                self.under_way.entry(Face { module, dock }).or_default().push_back(hop);
            }
            Behaviour::HormoneReceived(dock, data) => {
                seen.taken_up = cycle;
                if seen.received.replace(data) == Some(data) {
                    self.out_of_turn += 1;
                }
                self.receive(Face { module, dock }, cycle, data);
            }
        }
    }

    /// A link delivers in order: what was sent before the one that came is lost.
    fn receive(&mut self, at: Face, cycle: u64, data: Data) {
        let Some(hops) = self.wires.get(&at).and_then(|from| self.under_way.get_mut(from)) else { return };
        while let Some(hop) = hops.pop_front() {
            if hop.data == data && hop.sent + LOST_AFTER >= cycle {
                self.delivered += 1;
                self.latencies.add(cycle.saturating_sub(hop.taken_up));
                return;
            }
            self.skipped += 1;
        }
    }

    /// Hormones that did not arrive, and will not.
    pub fn lost(&self) -> u64 {
        let overdue = |hop: &&Hop| hop.sent + LOST_AFTER < self.now;
        self.skipped + self.under_way.values().flatten().filter(overdue).count() as u64
    }

    /// The hop latency's mean and maximum, in µs: from one module's HORMONE taking a hormone up, or generating it, to
    /// the next module's. `None` before the first.
    pub fn hop_latency_us(&self) -> Option<(f64, f64)> {
        let us = |cycles: f64| cycles * 1e6 / f64::from(CLOCK_HZ);
        let Latencies { number, sum, longest } = self.latencies;
        (number > 0).then(|| (us(sum as f64 / number as f64), us(longest as f64)))
    }

    /// How often a module's topology has changed.
    pub fn topology_changes(&self, module: usize) -> u64 {
        self.modules.get(module).map_or(0, |seen| seen.topology_changes)
    }
}

impl Latencies {
    fn add(&mut self, cycles: u64) {
        self.number += 1;
        self.sum += cycles;
        self.longest = self.longest.max(cycles);
    }
}
