//! Where the modules are, and what their sensors read.
//!
//! After a step, positions and frames are those at its beginning, a millisecond before angles and speeds.

use glam::{DAffine3, DVec3};
use plants::geometry::Half;
use plants::motion::Motion;

use super::World;
use crate::assumed::GRAVITY;
use crate::face::Face;
use crate::model::{self, MILLI, STEP_SECONDS};
use crate::weld;

impl World {
    /// The length of the robot along x, in m.
    pub fn length(&self) -> f64 {
        let corners = (0..self.modules()).flat_map(|module| self.corners_of(module));
        let (least, most) = corners.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), corner| {
            (least.min(corner.x), most.max(corner.x))
        });
        most - least
    }

    /// The number of modules.
    pub fn modules(&self) -> usize {
        self.motors.len()
    }

    /// The time since the beginning, in s.
    pub fn seconds(&self) -> f64 {
        self.steps as f64 * STEP_SECONDS
    }

    /// The angles of a module's joints, in rad.
    pub fn angles(&self, module: usize) -> [f64; 3] {
        self.layout.angles(self.simulation.positions(), module)
    }

    /// The speeds of a module's joints, in rad/s: where gears have backlash, of their motors.
    pub fn speeds(&self, module: usize) -> [f64; 3] {
        self.layout.motors(self.simulation.speeds(), module)
    }

    /// The reading of an accelerometer without a filter in the half with the Front dock, along x, y and z of
    /// that half, in multiples of the acceleration of gravity.
    pub fn acceleration(&self, module: usize) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.simulation.sensors()[3 * module + axis] / GRAVITY)
    }

    /// The frame of a dock, in mm.
    pub fn dock(&self, face: Face) -> DAffine3 {
        weld::dock(&self.simulation, face)
    }

    /// The frame of a module's front half, in mm.
    pub fn front(&self, module: usize) -> DAffine3 {
        let frame = weld::frame(&self.simulation, model::half(module, Half::Front));
        DAffine3 { translation: frame.translation / MILLI, ..frame }
    }

    /// The largest errors of docks that are attached, in mm and in degrees.
    pub fn dock_error(&self) -> (f64, f64) {
        let errors = self.welds.iter().flatten().map(|weld| weld.error(&self.simulation));
        errors.fold((0.0, 0.0), |(far, turned), (mm, degrees)| (far.max(mm), turned.max(degrees)))
    }

    /// The frame of a module, in mm.
    pub fn frame(&self, module: usize) -> DAffine3 {
        let frame = weld::frame(&self.simulation, model::root(module));
        DAffine3 { translation: frame.translation / MILLI, ..frame }
    }

    /// The middle of a module, in m.
    pub fn place(&self, module: usize) -> DVec3 {
        self.simulation.pose(model::root(module)).0
    }

    /// The direction out of the Up side of a module's part at the roll.
    pub fn up(&self, module: usize) -> DVec3 {
        self.simulation.pose(model::root(module)).1 * DVec3::Z
    }

    /// The middle of all modules, in m.
    pub fn middle(&self) -> DVec3 {
        self.middle_of(&(0..self.modules()).collect::<Vec<_>>())
    }

    /// The motion of the robot so far.
    pub fn motion(&self) -> Motion {
        self.odometer.motion(self.middle(), self.seconds())
    }

    /// The numbers that make up the world's state.
    pub fn state(&self) -> impl Iterator<Item = f64> {
        self.simulation.positions().iter().chain(self.simulation.speeds()).copied()
    }
}
