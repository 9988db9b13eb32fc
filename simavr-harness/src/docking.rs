//! What docks do to each other: light from one is reflected by another, and latches take hold and let go.

use plants::dock::{catches, reflected};
use simulation::{Change, Face, Facing};
use tasks::docking::latch::End;

use crate::robot::Robot;

impl Robot {
    /// Brings attachments to where latches are by now, and shows docks that look what is before them. Returns
    /// what the robot has changed of its wiring, in order.
    pub(crate) fn settle_docks(&mut self) -> Vec<Change> {
        let mut changes = Vec::new();
        for module in 0..self.members.len() {
            for (dock, end) in self.members[module].module.body_mut().take_arrivals() {
                let change = self.arrive(Face { module, dock }, end);
                changes.extend(change.filter(|change| self.change(change).is_ok()));
            }
        }
        for module in 0..self.members.len() {
            let looking = self.members[module].module.looking();
            for dock in looking.iter() {
                let nearest = self.before(Face { module, dock });
                let counts = nearest.map_or(0, |facing| reflected(facing.millimetres, facing.degrees));
                self.members[module].module.body_mut().reflect(dock, counts);
            }
        }
        changes
    }

    /// What comes of it that the latch of a dock has come to an end.
    fn arrive(&self, at: Face, end: End) -> Option<Change> {
        let is_attached = self.wiring().peer(at).is_some();
        match end {
            End::Released if is_attached => Some(Change::Detach(at)),
            End::Latched if !is_attached => {
                let Facing { face, millimetres, degrees } = self.before(at)?;
                catches(millimetres, degrees).then_some(Change::Attach(at, face))
            }
            _ => None,
        }
    }

    /// The dock that reflects most of the light of a free one.
    fn before(&self, face: Face) -> Option<Facing> {
        if self.wiring().peer(face).is_some() {
            return None;
        }
        let facing = match &self.physics {
            Some(physics) => physics.facing(self.wiring(), face),
            None => self.wiring().facing(face, |module| self.members[module].module.body().angles()),
        };
        facing.into_iter().max_by_key(|facing| reflected(facing.millimetres, facing.degrees))
    }
}
