//! How soon modules know what became of their docks.

use hormone::event::Event;

use crate::deed::Deed;
use crate::robot::Robot;
use crate::wiring::Wiring;

/// A module that has yet to find out.
#[derive(Clone, Copy)]
struct Change {
    at: u64,
    /// A neighbour went: that takes longer to notice than that one came.
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
    /// How often a module that knew its neighbours gave one up, or found it again, though nobody had touched it.
    pub lapses: u64,
}

impl Discovery {
    /// A robot at power-up.
    pub fn new(wiring: &Wiring) -> Self {
        let modules = wiring.modules();
        let mut discovery = Discovery {
            wiring: Wiring::new(modules),
            pending: vec![None; modules],
            last_change: vec![0; modules],
            found_after: None,
            lost_after: None,
            lapses: 0,
        };
        discovery.rewired(wiring, 0);
        discovery
    }

    /// The wiring is this now.
    pub fn rewired(&mut self, wiring: &Wiring, now: u64) {
        for module in 0..wiring.modules() {
            let (before, after) = (self.wiring.neighbours(module), wiring.neighbours(module));
            if before != after {
                let lost =
                    before.iter().zip(&after).any(|(before, after)| before.is_some() && before != after);
                self.pending[module] = Some(Change { at: now, is_loss: lost });
            }
        }
        self.wiring = wiring.clone();
    }

    /// Takes in the next deed.
    pub fn take(&mut self, deed: &Deed) {
        if let Event::TopologyChanged(_) = deed.event {
            self.last_change[deed.module] = deed.cycle;
            self.lapses += u64::from(self.pending[deed.module].is_none());
        }
    }

    /// Looks which modules know their neighbours by now.
    pub fn look(&mut self, robot: &impl Robot) {
        for (module, pending) in self.pending.iter_mut().enumerate() {
            let Some(Change { at, is_loss }) = *pending else { continue };
            if robot.is_right(module) {
                let longest = if is_loss { &mut self.lost_after } else { &mut self.found_after };
                *longest = (*longest).max(Some(self.last_change[module].saturating_sub(at)));
                *pending = None;
            }
        }
    }
}
