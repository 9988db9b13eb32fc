//! Docks that hold each other.

use glam::{DAffine3, DQuat, DVec3};
use plants::geometry::{Dock, attached};

use crate::assumed::{PULL_SPEED, PULL_TURN};
use crate::face::Face;
use crate::model::{self, MILLI, STEP_SECONDS};
use crate::mujoco::Simulation;

/// Two docks that hold each other. A weld begins with the docks where they are, and pulls them until they
/// fit.
pub struct Weld {
    pub faces: [Face; 2],
    /// The middles of the faces in the frames of their bodies, in m.
    points: [DVec3; 2],
    /// The rotation of the second body against the first at which the docks fit.
    turn: DQuat,
    /// The initial offset of the second dock from where it fits, in m, in the frame of the first body.
    off: DVec3,
    /// The initial rotation of the second body against the first.
    turned: DQuat,
    /// The fraction of the initial offset and rotation that is left, from 1 to 0.
    left: f64,
    /// The fraction that is pulled in a step.
    rate: f64,
}

impl Weld {
    /// A weld between two docks as they are now.
    pub fn new(simulation: &Simulation, faces: [Face; 2]) -> Self {
        let [one, other] = faces.map(|face| face.dock.in_half());
        let points = [one, other].map(|dock| dock.translation * MILLI);
        let fitting = one * attached(faces[0].dock, faces[1].dock) * other.inverse();
        let [first, second] = bodies(faces).map(|body| frame(simulation, body));
        let actual = first.inverse() * second;
        let off = actual.transform_point3(points[1]) - points[0];
        let turn = DQuat::from_mat3(&fitting.matrix3);
        let turned = DQuat::from_mat3(&actual.matrix3);
        let seconds = (off.length() / MILLI / PULL_SPEED)
            .max(turn.angle_between(turned).to_degrees() / PULL_TURN)
            .max(STEP_SECONDS);
        Weld { faces, points, turn, off, turned, left: 1.0, rate: STEP_SECONDS / seconds }
    }

    /// Whether the weld still pulls.
    pub fn pulls(&self) -> bool {
        self.left > 0.0
    }

    /// Pulls for a step, as the constraint `index`.
    pub fn pull(&mut self, simulation: &mut Simulation, index: usize) {
        self.left = (self.left - self.rate).max(0.0);
        self.hold(simulation, index);
    }

    /// Holds the module `other` in place of `one` from now on, and the other way round.
    pub fn swap(&mut self, one: usize, other: usize, simulation: &mut Simulation, index: usize) {
        for face in &mut self.faces {
            if face.module == one {
                face.module = other;
            } else if face.module == other {
                face.module = one;
            }
        }
        self.hold(simulation, index);
    }

    /// Holds the docks at the part of the offset that is left, as the constraint `index`.
    fn hold(&self, simulation: &mut Simulation, index: usize) {
        let points = [self.points[0] + self.off * self.left, self.points[1]];
        simulation.weld(index, bodies(self.faces), points, self.turn.slerp(self.turned, self.left));
    }

    /// The error of the docks against where they fit, in mm and in degrees.
    pub fn error(&self, simulation: &Simulation) -> (f64, f64) {
        let [one, other] = bodies(self.faces).map(|body| frame(simulation, body));
        let apart = one.transform_point3(self.points[0]) - other.transform_point3(self.points[1]);
        let turn = DQuat::from_mat3(&(one.inverse() * other).matrix3);
        (apart.length() / MILLI, turn.angle_between(self.turn).to_degrees())
    }
}

/// The bodies of the halves that have these docks.
fn bodies(faces: [Face; 2]) -> [usize; 2] {
    faces.map(|face| model::half(face.module, face.dock.half()))
}

/// The frame of a body in the world, in m.
pub fn frame(simulation: &Simulation, body: usize) -> DAffine3 {
    let (position, turn) = simulation.pose(body);
    DAffine3::from_rotation_translation(turn, position)
}

/// The frame of a dock in the world, in mm.
pub fn dock(simulation: &Simulation, Face { module, dock }: Face) -> DAffine3 {
    let half = frame(simulation, model::half(module, Dock::half(dock)));
    let half = DAffine3 { translation: half.translation / MILLI, ..half };
    half * dock.in_half()
}
