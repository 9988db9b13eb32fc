//! How soon modules know what became of their docks.

use hormone::event::Event;
use hormone::status::Status;
use tasks::dock::Dock;

use crate::robot::Robot;
use crate::trace_event::TraceEvent;
use crate::wiring::{Face, Wiring};

/// What a module has yet to find out.
#[derive(Clone, Copy)]
struct Change {
    at: u64,
    /// A neighbour went, which takes longer to notice than that one came.
    is_loss: bool,
}

/// Times how long each module takes from a change of its wiring until it knows its neighbours and its type.
pub struct Discovery {
    wiring: Wiring,
    pending: Vec<Option<Change>>,
    last_change: Vec<u64>,
    /// The longest that a module took to find a neighbour, in cycles.
    pub found_after: Option<u64>,
    /// The longest that a module took to notice that a neighbour was gone, in cycles.
    pub lost_after: Option<u64>,
    /// How often a module that knew its neighbours gave one up, or found it again, though nothing had
    /// happened to either.
    pub lapses: u64,
}

impl Discovery {
    /// A robot at power-up.
    pub fn new(robot: &impl Robot) -> Self {
        let wiring = robot.wiring();
        let modules = wiring.modules();
        let on_since = |module: usize| {
            let peers = Dock::ALL.map(|dock| wiring.peer(Face { module, dock }));
            let on = peers.iter().flatten().map(|peer| robot.powered_up_at(peer.module));
            on.chain([robot.powered_up_at(module)]).max().unwrap_or(0)
        };
        let has_neighbour = |module: usize| wiring.neighbours(module) != [None; 6];
        let pending =
            |module: usize| has_neighbour(module).then(|| Change { at: on_since(module), is_loss: false });
        Discovery {
            wiring: wiring.clone(),
            pending: (0..modules).map(pending).collect(),
            last_change: vec![0; modules],
            found_after: None,
            lost_after: None,
            lapses: 0,
        }
    }

    /// Takes in the new wiring.
    pub fn rewired(&mut self, wiring: &Wiring, now: u64) {
        for module in 0..wiring.modules() {
            let (before, after) = (self.wiring.neighbours(module), wiring.neighbours(module));
            if before != after {
                let is_loss =
                    before.iter().zip(&after).any(|(before, after)| before.is_some() && before != after);
                self.pending[module] = Some(Change { at: now, is_loss });
            }
        }
        self.wiring = wiring.clone();
    }

    /// A module starts over, and has to find its neighbours again.
    pub fn restarted(&mut self, module: usize, now: u64) {
        self.pending[module] = Some(Change { at: now, is_loss: false });
    }

    /// Takes in the next trace event.
    pub fn take(&mut self, trace_event: &TraceEvent) {
        if let Event::TopologyChanged(_) = trace_event.event {
            self.last_change[trace_event.module] = trace_event.cycle;
            self.lapses += u64::from(self.is_calm(trace_event.module));
        }
    }

    /// Whether nothing has happened to the module or its neighbours that they have yet to find out.
    fn is_calm(&self, module: usize) -> bool {
        let peers = Dock::ALL.map(|dock| self.wiring.peer(Face { module, dock }));
        let mut all = peers.iter().flatten().map(|peer| peer.module).chain([module]);
        all.all(|module| self.pending[module].is_none())
    }

    /// Checks which modules know their neighbours by now.
    pub fn look(&mut self, robot: &impl Robot) {
        for (module, pending) in self.pending.iter_mut().enumerate() {
            let Some(Change { at, is_loss }) = *pending else { continue };
            // Before its first event after the change the module only seems to know.
            let last_change = self.last_change[module];
            if last_change > at && is_right(robot, &self.wiring, module) {
                let longest = if is_loss { &mut self.lost_after } else { &mut self.found_after };
                *longest = (*longest).max(Some(last_change - at));
                *pending = None;
            }
        }
    }
}

/// Whether a module knows its neighbours as the wiring has them. A module without power knows none, and
/// counts as right.
fn is_right(robot: &impl Robot, wiring: &Wiring, module: usize) -> bool {
    let knows = |status: Status| status.neighbours() == Some(wiring.neighbours(module));
    !robot.is_on(module) || robot.status(module).is_some_and(knows)
}
