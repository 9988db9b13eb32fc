//! Measures how far a robot has come.

use glam::DVec3;
use plants::motion::{Motion, turned};

/// Steps between two looks: 10 ms.
pub const LOOK: u64 = 10;

/// Follows a robot.
#[derive(Default)]
pub struct Odometer {
    start: DVec3,
    length: f64,
    /// The initial axes of all bodies, seen from above.
    axes: Vec<[f64; 2]>,
    /// The angle by which the axes have turned to the left, in degrees.
    heading: f64,
    /// The sum of normal forces over all looks, and the sum of these forces times the speed of sliding.
    borne: f64,
    slid: f64,
}

impl Odometer {
    /// Follows a robot from where its middle is, in m, with its length, in m, and the axes of its bodies.
    pub fn new(start: DVec3, length: f64, axes: Vec<[f64; 2]>) -> Self {
        Odometer { start, length, axes, ..Odometer::default() }
    }

    /// Measures heading and slip, every [`LOOK`] steps: by the axes of all bodies, and by each contact's
    /// normal force, in N, and speed of sliding, in m/s.
    pub fn look(&mut self, axes: &[[f64; 2]], slides: &[(f64, f64)]) {
        self.heading = turned(&self.axes, axes, self.heading);
        for (force, speed) in slides {
            self.borne += force;
            self.slid += force * speed;
        }
    }

    /// The motion until now, with the robot's middle at `middle`, in m, after `seconds`.
    pub fn motion(&self, middle: DVec3, seconds: f64) -> Motion {
        let way = middle - self.start;
        let speed = way.truncate().length() / seconds;
        Motion {
            distance: way.x,
            sideways: way.y,
            heading: self.heading,
            length: self.length,
            slip: self.slid / self.borne / speed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_from_the_start_and_slip_is_weighed_by_force() {
        let axis = |degrees: f64| vec![[degrees.to_radians().cos(), degrees.to_radians().sin()]];
        let mut odometer = Odometer::new(DVec3::new(1.0, 2.0, 0.5), 0.8, axis(0.0));
        for (degrees, slides) in
            [(80.0, vec![]), (160.0, vec![(2.0, 0.1), (1.0, 0.7)]), (240.0, vec![(2.0, 0.3)])]
        {
            odometer.look(&axis(degrees), &slides);
        }
        // 5 m in 10 s; what bears 5 N in all slides at 0.3 m/s in the mean.
        let Motion { distance, sideways, heading, length, slip } =
            odometer.motion(DVec3::new(4.0, -2.0, 9.0), 10.0);
        assert_eq!((distance, sideways, length), (3.0, -4.0, 0.8));
        assert!((heading - 240.0).abs() < 1e-9, "{heading}");
        assert!((slip - 0.3 / 0.5).abs() < 1e-9, "{slip}");
    }
}
