//! A native robot in a world: what passes between the two each millisecond.

use tasks::dock::DockSet;

use super::Native;
use super::embodied::Embodied;
use crate::body::Body;
use crate::change::Change;
use crate::docking::Bodies;
use crate::environment::Environment;
use crate::hardware::MILLISECOND;
use crate::pose::Facing;
use crate::robot::Robot;
use crate::scenario::Event;
use crate::wiring::{Face, Wiring, WiringError};

/// How often docks are looked at, if any of them does something, in cycles: 10 ms.
const DOCKING: u64 = 10 * MILLISECOND;

/// How often it is found out which free docks hear which, in cycles: 100 ms.
const LOOK_AROUND: u64 = 100 * MILLISECOND;

impl Native {
    /// Puts a robot at power-up into a world, which has it as it is wired.
    #[must_use]
    pub fn within(mut self, mut world: Box<dyn Environment>) -> Self {
        for (index, module) in self.modules.iter_mut().enumerate() {
            let mut embodied = Box::new(Embodied::new());
            world.enter(index, &mut embodied.body);
            module.embody(embodied);
        }
        self.world = Some(world);
        self.set_latches(&Wiring::new(self.modules.len()));
        self
    }

    /// At the beginning of a millisecond, shows modules where the world has them, and has the world take its
    /// next step.
    pub(super) fn meet_world(&mut self) {
        if !self.now.is_multiple_of(MILLISECOND) {
            return;
        }
        let Some(world) = &mut self.world else { return };
        for (index, module) in self.modules.iter_mut().enumerate() {
            let Some(embodied) = module.embodied_mut() else { continue };
            world.exchange(index, &mut embodied.body);
            module.drive(self.now);
            self.due[index] = self.due[index].min(module.due());
        }
        world.step();
        if self.now.is_multiple_of(LOOK_AROUND) {
            self.look_around();
        }
        let does_something = |body: &Embodied| body.body.has_arrived() || !body.looking().is_empty();
        if self.now.is_multiple_of(DOCKING)
            && self.modules.iter().filter_map(|module| module.embodied()).any(does_something)
        {
            let at = self.now;
            let changes = Bodies::settle_docks(self).into_iter();
            self.changes.extend(changes.map(|change| Event { at, change }));
        }
    }

    /// Has the world follow a change of the wiring, which was `before`.
    pub(super) fn change_world(&mut self, change: &Change, before: &Wiring) {
        let Some(world) = &mut self.world else { return };
        world.change(change, before, &self.wiring);
        self.look_around();
        self.set_latches(before);
    }

    /// Lets free docks hear those that they see in the world by now.
    fn look_around(&mut self) {
        let Some(world) = &self.world else { return };
        self.in_sight = world.in_sight(&self.wiring);
        self.measure();
    }
}

impl Bodies for Native {
    fn wiring(&self) -> &Wiring {
        &self.wiring
    }

    fn body_mut(&mut self, module: usize) -> Option<&mut Body> {
        Some(&mut self.modules[module].embodied_mut()?.body)
    }

    fn looking(&self, module: usize) -> DockSet {
        self.modules[module].embodied().map_or(DockSet::EMPTY, Embodied::looking)
    }

    fn facing(&self, from: Face) -> Vec<Facing> {
        self.world.as_ref().map_or(Vec::new(), |world| world.facing(&self.wiring, from))
    }

    fn change(&mut self, change: &Change) -> Result<(), WiringError> {
        Robot::change(self, change)
    }
}
