//! Docks that attach and let go by themselves, where there is no world: without latches, and with joints that
//! are where they were told to be last. A module that was told nothing yet is straight.

use hormone::action::Docking;
use plants::dock::catches;
use tasks::dock::Dock;

use super::Native;
use super::time::{APPROACH, RELEASE};
use crate::change::Change;
use crate::robot::Robot;
use crate::scenario::Event;
use crate::wiring::Face;

/// A module's request to a dock, and when it is done.
#[derive(Clone, Copy)]
pub struct Due {
    pub at: u64,
    pub module: usize,
    docking: Docking,
}

impl Due {
    /// A module has asked for this at `asked_at`.
    pub fn new(module: usize, docking: Docking, asked_at: u64) -> Self {
        let takes = match docking {
            Docking::Approach(_) => APPROACH,
            Docking::Release(_) => RELEASE,
        };
        Due { at: asked_at + takes, module, docking }
    }

    pub fn dock(&self) -> Dock {
        match self.docking {
            Docking::Approach(dock) | Docking::Release(dock) => dock,
        }
    }
}

/// A request to a dock takes no less than this.
pub const SOONEST: u64 = RELEASE;

impl Native {
    /// Does what has been asked of docks and is due by now.
    pub(super) fn do_due(&mut self) {
        let mut due: Vec<Due> = self.dockings.extract_if(.., |due| due.at <= self.now).collect();
        due.sort_by_key(|due| (due.at, due.module));
        for change in due.into_iter().filter_map(|due| self.outcome(due)).collect::<Vec<_>>() {
            if self.change(&change).is_ok() {
                self.changes.push(Event { at: self.now, change });
            }
        }
    }

    fn outcome(&self, Due { module, docking, .. }: Due) -> Option<Change> {
        match docking {
            Docking::Release(dock) => Some(Change::Detach(Face { module, dock })),
            Docking::Approach(dock) => {
                let at = Face { module, dock };
                let mut facing = self.wiring().facing(at, |module| self.modules[module].angles()).into_iter();
                let near = facing.find(|facing| catches(facing.millimetres, facing.degrees))?;
                Some(Change::Attach(at, near.face))
            }
        }
    }
}
