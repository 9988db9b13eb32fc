//! Measures how far a robot has come.

use glam::DVec3;
use plants::motion::{Motion, turned};

use crate::world::World;

/// Steps between two measurements of heading and slip: 10 ms.
const LOOK: u64 = 10;

/// Follows a robot.
#[derive(Default)]
pub struct Odometer {
    start: DVec3,
    length: f64,
    /// The initial axes of all bodies, seen from above.
    axes: Vec<[f64; 2]>,
    /// The angle by which the axes have turned to the left, in degrees.
    heading: f64,
    looks: u64,
    /// The sum of normal forces over all measurements, and the sum of these forces times the speed of
    /// sliding.
    borne: f64,
    slid: f64,
}

impl Odometer {
    pub fn new(world: &World) -> Self {
        Odometer { start: world.middle(), length: world.length(), axes: world.axes(), ..Odometer::default() }
    }

    /// Measures the world after a step.
    pub fn look(mut self, world: &World) -> Self {
        self.looks += 1;
        if self.looks.is_multiple_of(LOOK) {
            self.heading = turned(&self.axes, &world.axes(), self.heading);
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
        Motion {
            distance: way.x,
            sideways: way.y,
            heading: self.heading,
            length: self.length,
            slip: self.slid / self.borne / speed,
        }
    }
}
