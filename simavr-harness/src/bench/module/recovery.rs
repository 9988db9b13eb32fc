//! Measures how soon a robot recovers after a fault of a module.

use std::collections::BTreeMap;

use hormone::event::Event;
use simulation::{Face, Robot, TraceEvent};

use super::{MILLISECOND, SECOND};
use crate::bench::{BenchError, unmeasurable};
use crate::engine::Engine;

/// The time for which a robot is watched, in cycles.
const WATCHED: u64 = 2 * SECOND;

/// The longest time that a hormone may take to a neighbour, in cycles.
const UNDER_WAY: u64 = 100 * MILLISECOND;

/// The cycles from now until the robot has recovered for good: each module's view of its neighbours equals
/// the wiring, hormones arrive, and `is_back`, which is called each millisecond, returns true.
pub fn recovery(engine: &mut Engine, mut is_back: impl FnMut(&Engine) -> bool) -> Result<u64, BenchError> {
    let start = engine.cycle();
    engine.take_trace_events();
    let mut hormones = Hormones { under_way: BTreeMap::new(), last_lost: start, arrived: 0 };
    let mut last_wrong = start;
    while engine.cycle() < start + WATCHED {
        engine.run_until(engine.cycle() + MILLISECOND);
        let are_right = (0..engine.robot().modules()).all(|module| engine.is_right(module));
        if !are_right || !is_back(engine) {
            last_wrong = engine.cycle();
        }
        for trace_event in engine.take_trace_events() {
            hormones.take(engine, trace_event);
        }
    }
    hormones.give_up(engine.cycle());
    if hormones.arrived == 0 || last_wrong == engine.cycle() {
        return Err(unmeasurable("firmware-master", "the module does not come back into the robot"));
    }
    Ok(last_wrong.max(hormones.last_lost) - start)
}

/// Follows hormones, by the docks that they leave by.
struct Hormones {
    /// The cycles at which they left.
    under_way: BTreeMap<(usize, u8), u64>,
    /// The cycle at which the last hormone left that did not arrive.
    last_lost: u64,
    arrived: u64,
}

impl Hormones {
    fn take(&mut self, engine: &Engine, trace_event: TraceEvent) {
        let key = |face: Face| (face.module, face.dock.index());
        match trace_event.event {
            Event::HormoneSent(dock, _) => {
                let left = self.under_way.insert((trace_event.module, dock.index()), trace_event.cycle);
                self.last_lost = self.last_lost.max(left.unwrap_or(0));
            }
            Event::HormoneReceived(dock, _) | Event::HormoneDropped(dock) => {
                let from = engine.robot().neighbour(Face { module: trace_event.module, dock });
                if from.and_then(|from| self.under_way.remove(&key(from))).is_some() {
                    self.arrived += 1;
                }
            }
            _ => {}
        }
    }

    /// Counts the hormones as lost that have been under way for more than [`UNDER_WAY`].
    fn give_up(&mut self, now: u64) {
        let lost = self.under_way.values().copied().filter(|left| left + UNDER_WAY < now).max();
        self.last_lost = self.last_lost.max(lost.unwrap_or(0));
    }
}
