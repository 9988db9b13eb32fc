//! The docks of a robot in simavr: its bodies, and the positions of its docks by the world or, without one,
//! by its joints.

use simulation::{Bodies, Body, Change, Environment, Face, Facing, Wiring, WiringError};
use tasks::dock::DockSet;

use crate::robot::Robot;

impl Bodies for Robot {
    fn wiring(&self) -> &Wiring {
        self.wiring()
    }

    fn body_mut(&mut self, module: usize) -> Option<&mut Body> {
        Some(self.members.get_mut(module)?.module.body_mut())
    }

    fn looking(&self, module: usize) -> DockSet {
        self.members[module].module.looking()
    }

    fn facing(&self, from: Face) -> Vec<Facing> {
        match &self.physics {
            Some(physics) => physics.facing(self.wiring(), from),
            None => self.wiring().facing(from, |module| self.members[module].module.body().angles()),
        }
    }

    fn change(&mut self, change: &Change) -> Result<(), WiringError> {
        self.change(change)
    }
}
