//! How far a robot has come.

use glam::DVec3;

use crate::world::World;

/// Steps between two looks at what slides: 10 ms.
const LOOK: u64 = 10;

/// How a robot has moved since the beginning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// How far its middle has come ahead, in m: along x, where module 0 looked at the beginning.
    pub distance: f64,
    /// How far it has come to the left, in m.
    pub sideways: f64,
    /// How long the robot was at the beginning, along x, in m.
    pub length: f64,
    /// The mean speed at which what bears the robot slides on the ground, weighted by what it bears, over the
    /// robot's mean speed. Infinite for a robot that has not come anywhere.
    pub slip: f64,
}

/// Follows a robot.
#[derive(Default)]
pub struct Odometer {
    start: DVec3,
    length: f64,
    looks: u64,
    /// Force times time, and that times the speed of sliding.
    borne: f64,
    slid: f64,
}

impl Odometer {
    pub fn new(world: &World) -> Self {
        Odometer { start: world.middle(), length: world.length(), ..Odometer::default() }
    }

    /// Looks at the world after a step.
    pub fn look(mut self, world: &World) -> Self {
        self.looks += 1;
        if self.looks.is_multiple_of(LOOK) {
            for (force, speed) in world.slides() {
                self.borne += force;
                self.slid += force * speed;
            }
        }
        self
    }

    pub fn motion(&self, world: &World) -> Motion {
        let way = world.middle() - self.start;
        let speed = way.truncate().length() / world.seconds();
        Motion { distance: way.x, sideways: way.y, length: self.length, slip: self.slid / self.borne / speed }
    }
}
