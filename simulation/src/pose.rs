//! Where the docks of a robot are, by the angles of its joints: its modules as rigid bodies, and nothing else. There is
//! neither ground nor gravity, and bodies do not collide. A ring is cut open to be measured: what its joints do has no
//! effect on each other.
//!
//! A module is two cubes in a row. In the middle of each a joint bends it, and between them a third joint rolls. The frame
//! of a module has its origin between the cubes; x points to the Front, y to the Left, z to the Up of a straight module. The
//! frame of a dock has its origin in the middle of the dock's face, x points outwards, and z is what lies on z of the
//! dock that is attached to it.

use std::collections::VecDeque;

use glam::{DAffine3, DMat3, DQuat, DVec3};
use tasks::dock::Dock;

use crate::wiring::{Face, Wiring};

/// The edge of a cube, in mm (Salemi, Moll and Shen, 2006: a module is 168 mm long).
const EDGE: f64 = 84.0;

/// The angles of a module's three joints, in degrees, in the order of [`Axis::ALL`](tasks::motor::Axis::ALL).
pub type Angles = [f64; 3];

/// A dock before another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facing {
    pub face: Face,
    /// From the middle of one to the middle of the other.
    pub millimetres: f64,
    /// By how much it is turned, in any direction, from where it would fit.
    pub degrees: f64,
}

impl Wiring {
    /// The free docks of the same body that a dock looks at, with `angles` of each module.
    pub fn facing(&self, from: Face, angles: impl Fn(usize) -> Angles) -> Vec<Facing> {
        let fits = (dock(angles(from.module), from.dock) * opposite()).inverse();
        let mut facing = Vec::new();
        for (module, pose) in self.poses(from.module, &angles) {
            for dock_of_body in Dock::ALL {
                let face = Face { module, dock: dock_of_body };
                if face == from || self.peer(face).is_some() {
                    continue;
                }
                // Where it is, seen from where it would fit.
                let off = fits * pose * dock(angles(module), dock_of_body);
                let degrees = DQuat::from_mat3(&off.matrix3).angle_between(DQuat::IDENTITY).to_degrees();
                let is_behind = off.translation.x > EDGE / 2.0;
                if degrees < 90.0 && !is_behind {
                    facing.push(Facing { face, millimetres: off.translation.length(), degrees });
                }
            }
        }
        facing
    }

    /// The frames of all modules of the body that a module is one of, seen from that one: the shortest way to each counts.
    fn poses(&self, first: usize, angles: &impl Fn(usize) -> Angles) -> Vec<(usize, DAffine3)> {
        let mut is_found = vec![false; self.modules()];
        let mut next = VecDeque::from([(first, DAffine3::IDENTITY)]);
        let mut poses = Vec::new();
        while let Some((module, pose)) = next.pop_front() {
            if std::mem::replace(&mut is_found[module], true) {
                continue;
            }
            poses.push((module, pose));
            for own in Dock::ALL {
                if let Some(peer) = self.peer(Face { module, dock: own }) {
                    let attached = pose * dock(angles(module), own) * opposite();
                    next.push_back((peer.module, attached * dock(angles(peer.module), peer.dock).inverse()));
                }
            }
        }
        poses
    }
}

/// The frame of a dock in that of its module.
fn dock(angles: Angles, dock: Dock) -> DAffine3 {
    // Positive angles bend both halves towards Up.
    let [front, roll, back] = angles.map(f64::to_radians);
    let half = match dock {
        Dock::Front | Dock::Left | Dock::Right => {
            DAffine3::from_translation(DVec3::X * (EDGE / 2.0)) * DAffine3::from_rotation_y(-front)
        }
        Dock::Back | Dock::Up | Dock::Down => {
            DAffine3::from_rotation_x(roll)
                * DAffine3::from_translation(DVec3::NEG_X * (EDGE / 2.0))
                * DAffine3::from_rotation_y(back)
        }
    };
    half * DAffine3::from_mat3(orientation(dock)) * DAffine3::from_translation(DVec3::X * (EDGE / 2.0))
}

/// How a dock is turned in its half. On z of all docks round a module lies its Up, on that of Up and Down its Front.
fn orientation(dock: Dock) -> DMat3 {
    let [outwards, up] = match dock {
        Dock::Front => [DVec3::X, DVec3::Z],
        Dock::Back => [DVec3::NEG_X, DVec3::Z],
        Dock::Left => [DVec3::Y, DVec3::Z],
        Dock::Right => [DVec3::NEG_Y, DVec3::Z],
        Dock::Up => [DVec3::Z, DVec3::X],
        Dock::Down => [DVec3::NEG_Z, DVec3::X],
    };
    DMat3::from_cols(outwards, up.cross(outwards), up)
}

/// From a dock's frame to that of one attached to it.
fn opposite() -> DAffine3 {
    DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(-1.0, -1.0, 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Shape;
    use Dock::{Back, Down, Front, Left, Right, Up};

    fn chain() -> Wiring {
        Shape::Chain.wiring(6).unwrap()
    }

    fn face(module: usize, dock: Dock) -> Face {
        Face { module, dock }
    }

    /// How the dock `to` lies before `from`.
    fn seen(wiring: &Wiring, from: Face, to: Face, angles: impl Fn(usize) -> Angles) -> Option<Facing> {
        wiring.facing(from, angles).into_iter().find(|facing| facing.face == to)
    }

    #[test]
    fn the_ends_of_six_that_curl_meet() {
        for (from, to) in [(face(0, Front), face(5, Back)), (face(5, Back), face(0, Front))] {
            for bend in [30.0, -30.0] {
                let facing = seen(&chain(), from, to, |_| [bend, 0.0, bend]).unwrap();
                assert!(facing.millimetres < 1e-9 && facing.degrees < 1e-4, "{facing:?}");
            }
        }
    }

    #[test]
    fn a_joint_a_degree_off_moves_what_is_behind_it() {
        // Of a regular twelve-sided polygon with sides of 84 mm the first joint is 42 mm from the gap.
        let angles = |module| if module == 0 { [31.0, 0.0, 30.0] } else { [30.0, 0.0, 30.0] };
        let facing = seen(&chain(), face(5, Back), face(0, Front), angles).unwrap();
        assert!((facing.degrees - 1.0).abs() < 1e-4, "{facing:?}");
        assert!((facing.millimetres - 42.0 * 1_f64.to_radians()).abs() < 1e-3, "{facing:?}");
    }

    #[test]
    fn the_ends_of_a_straight_chain_look_away_from_each_other() {
        assert_eq!(seen(&chain(), face(0, Front), face(5, Back), |_| [0.0; 3]), None);
    }

    #[test]
    fn what_is_attached_or_of_another_body_is_not_seen() {
        let mut wiring = chain();
        wiring.attach(face(5, Back), face(0, Front)).unwrap();
        assert_eq!(
            wiring.facing(face(1, Front), |_| [30.0, 0.0, 30.0]).into_iter().find(|it| it.face.dock == Back),
            None
        );
        assert_eq!(
            Wiring::new(2).facing(face(0, Front), |_| [0.0; 3]).iter().find(|it| it.face.module == 1),
            None
        );
    }

    #[test]
    fn every_pair_of_docks_fits_as_it_is_attached() {
        for one in Dock::ALL {
            for other in Dock::ALL {
                let mut wiring = Wiring::new(2);
                wiring.attach(face(0, one), face(1, other)).unwrap();
                let poses = wiring.poses(0, &|module| [10.0 * module as f64, 20.0, -30.0]);
                let [(0, _), (1, pose)] = poses[..] else { panic!("both are found") };
                let frame = pose * dock([10.0, 20.0, -30.0], other);
                let fitting = dock([0.0, 20.0, -30.0], one) * opposite();
                assert!(frame.abs_diff_eq(fitting, 1e-9), "{one:?} {other:?}");
            }
        }
    }

    #[test]
    fn docks_lie_where_a_straight_module_has_them() {
        let middles = [Front, Back, Left, Right, Up, Down].map(|place| dock([0.0; 3], place).translation);
        let expected = [
            [84.0, 0.0, 0.0],
            [-84.0, 0.0, 0.0],
            [42.0, 42.0, 0.0],
            [42.0, -42.0, 0.0],
            [-42.0, 0.0, 42.0],
            [-42.0, 0.0, -42.0],
        ];
        for (middle, expected) in middles.into_iter().zip(expected) {
            assert!(middle.abs_diff_eq(expected.into(), 1e-9), "{middle}");
        }
        let lifted = dock([90.0, 0.0, 0.0], Front).translation;
        assert!(lifted.abs_diff_eq([42.0, 0.0, 42.0].into(), 1e-9), "{lifted}");
    }
}
