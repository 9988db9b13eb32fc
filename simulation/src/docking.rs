//! The effects of docks on each other: light from one is reflected by another, and latches take hold and let
//! go.

use plants::dock::{catches, reflected};
use tasks::dock::DockSet;
use tasks::docking::latch::End;

use crate::body::Body;
use crate::change::Change;
use crate::pose::Facing;
use crate::wiring::{Face, Wiring, WiringError};

/// A robot whose modules have bodies.
pub trait Bodies {
    /// How its modules are attached to each other now.
    fn wiring(&self) -> &Wiring;

    /// The body of a module; `None` where it is not simulated.
    fn body_mut(&mut self, module: usize) -> Option<&mut Body>;

    /// The docks of a module that send out light, to look for others.
    fn looking(&self, module: usize) -> DockSet;

    /// The free docks that a free dock looks at.
    fn facing(&self, from: Face) -> Vec<Facing>;

    /// Lets something happen to the robot now.
    ///
    /// # Errors
    /// It can't happen to a robot that is wired so.
    fn change(&mut self, change: &Change) -> Result<(), WiringError>;

    /// Updates attachments to where latches are by now, and shows docks that look for others what is before
    /// them. Returns what the robot has changed of its wiring, in order.
    fn settle_docks(&mut self) -> Vec<Change> {
        let modules = self.wiring().modules();
        let mut changes = Vec::new();
        for module in 0..modules {
            for (dock, end) in self.body_mut(module).map(Body::take_arrivals).unwrap_or_default() {
                let change = self.arrive(Face { module, dock }, end);
                changes.extend(change.filter(|change| self.change(change).is_ok()));
            }
        }
        for module in 0..modules {
            for dock in self.looking(module).iter() {
                let face = Face { module, dock };
                let counts = match self.wiring().attached(face) {
                    Some(_) => reflected(0.0, 0.0),
                    None => {
                        self.before(face).map_or(0, |facing| reflected(facing.millimetres, facing.degrees))
                    }
                };
                if let Some(body) = self.body_mut(module) {
                    body.reflect(dock, counts);
                }
            }
        }
        changes
    }

    /// Latches the docks that have been attached since the wiring was `before`, and releases those that have
    /// come off.
    fn set_latches(&mut self, before: &Wiring) {
        let faces: Vec<Face> = before.faces().chain(self.wiring().faces()).collect();
        for face in faces {
            let attached = self.wiring().attached(face);
            if attached != before.attached(face)
                && let Some(body) = self.body_mut(face.module)
            {
                body.set_latch(face.dock, if attached.is_some() { End::Latched } else { End::Released });
            }
        }
    }

    /// The change that follows, if any, when the latch of a dock has come to an end.
    fn arrive(&mut self, at: Face, end: End) -> Option<Change> {
        let is_attached = self.wiring().attached(at).is_some();
        match end {
            End::Released if is_attached => Some(Change::Detach(at)),
            End::Latched if !is_attached => {
                let Facing { face, millimetres, degrees } = self.before(at)?;
                let is_held = catches(millimetres, degrees) && self.body_mut(at.module)?.takes_hold();
                is_held.then_some(Change::Attach(at, face))
            }
            _ => None,
        }
    }

    /// The dock that reflects most of the light of a free one.
    fn before(&self, face: Face) -> Option<Facing> {
        let facing = self.facing(face).into_iter();
        facing.max_by_key(|facing| reflected(facing.millimetres, facing.degrees))
    }
}
