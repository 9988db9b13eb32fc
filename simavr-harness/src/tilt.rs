//! Measures how far the modules lean that legs carry.

use hormone::module_type::ModuleType::{LeftLeg, RightLeg};
use simulation::{Face, Wiring};
use tasks::dock::Dock;
use world::World;

/// Follows the modules with two legs. A robot that falls shows as leaning.
#[derive(Default)]
pub(crate) struct Tilt {
    carried: Vec<usize>,
    most: f64,
}

impl Tilt {
    /// Takes over a new wiring of the robot.
    pub fn wired(&mut self, wiring: &Wiring) {
        let is_leg = |module| matches!(wiring.module_type(module), LeftLeg | RightLeg);
        let leg = |module, dock| wiring.peer(Face { module, dock }).is_some_and(|face| is_leg(face.module));
        self.carried = (0..wiring.modules())
            .filter(|&module| leg(module, Dock::Left) && leg(module, Dock::Right))
            .collect();
    }

    /// Measures a robot that was laid down turned by `roll` degrees about its long axis.
    pub fn look(&mut self, world: &World, roll: f64) {
        for &module in &self.carried {
            let lean = world.up(module).z.clamp(-1.0, 1.0).acos().to_degrees();
            self.most = self.most.max((lean - roll.abs()).abs());
        }
    }

    /// The most that any of the modules leaned, in degrees from how it was laid down.
    pub fn most(&self) -> f64 {
        self.most
    }
}
