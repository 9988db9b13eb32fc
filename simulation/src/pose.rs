//! Where the docks of a robot are, and which way is up in each module, by the angles of its joints: its
//! modules as rigid bodies, and nothing else. There is no ground, and bodies do not collide. A ring is cut
//! open to be measured: its joints do not constrain each other. What a module looks like is in
//! [`plants::geometry`].

use std::collections::VecDeque;

use glam::{DAffine3, DQuat, DVec3};
use hormone::module_type::ModuleType;
use plants::geometry::{self, Half};
use tasks::dock::Dock;

use crate::wiring::{Face, Wiring};

/// The angles of a module's three joints, in degrees, in the order of [`Axis::ALL`](tasks::motor::Axis::ALL).
pub type Angles = geometry::Angles;

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
        let own = dock(angles(from.module), from.dock);
        let mut facing = Vec::new();
        for (module, pose) in self.poses(from.module, &angles, &mut vec![false; self.modules()]) {
            for dock_of_body in Dock::ALL {
                let face = Face { module, dock: dock_of_body };
                if face == from || self.attached(face).is_some() {
                    continue;
                }
                let there = pose * dock(angles(module), dock_of_body);
                let lies = geometry::before((place(from.dock), own), (place(dock_of_body), there));
                facing.extend(lies.map(|(millimetres, degrees)| Facing { face, millimetres, degrees }));
            }
        }
        facing
    }

    /// What the accelerometers of all modules at rest read along x, y and z of their halves with the Front
    /// dock, in multiples of the acceleration of gravity, with `angles` of each module. Each body lies as the
    /// module of lowest number that is no leg does: turned about its x by `roll` degrees.
    pub fn accelerations(&self, roll: f64, angles: impl Fn(usize) -> Angles) -> Vec<[f64; 3]> {
        let up = DQuat::from_rotation_x(-roll.to_radians()) * DVec3::Z;
        let mut accelerations = vec![[0.0; 3]; self.modules()];
        let mut is_found = vec![false; self.modules()];
        let is_leg =
            |&module: &usize| matches!(self.module_type(module), ModuleType::LeftLeg | ModuleType::RightLeg);
        let firsts =
            (0..self.modules()).filter(|module| !is_leg(module)).chain((0..self.modules()).filter(is_leg));
        for first in firsts {
            if is_found[first] {
                continue;
            }
            for (module, pose) in self.poses(first, &angles, &mut is_found) {
                let half = pose.matrix3 * Half::Front.in_module(angles(module)).matrix3;
                accelerations[module] = (half.transpose() * up).to_array();
            }
        }
        accelerations
    }

    /// The frames of all modules of the body that a module is one of, seen from that one: the shortest way to
    /// each counts. None of the body `is_found` before, and all after.
    pub(crate) fn poses(
        &self,
        first: usize,
        angles: &impl Fn(usize) -> Angles,
        is_found: &mut [bool],
    ) -> Vec<(usize, DAffine3)> {
        let mut next = VecDeque::from([(first, DAffine3::IDENTITY)]);
        let mut poses = Vec::new();
        while let Some((module, pose)) = next.pop_front() {
            if std::mem::replace(&mut is_found[module], true) {
                continue;
            }
            poses.push((module, pose));
            for own in Dock::ALL {
                if let Some(peer) = self.attached(Face { module, dock: own })
                    && !is_found[peer.module]
                {
                    let place = pose * dock(angles(module), own) * attached(own, peer.dock);
                    next.push_back((peer.module, place * dock(angles(peer.module), peer.dock).inverse()));
                }
            }
        }
        poses
    }
}

/// The frame of a dock in that of its module.
fn dock(angles: Angles, dock: Dock) -> DAffine3 {
    place(dock).in_module(angles)
}

/// From a dock's frame to that of one attached to it.
fn attached(one: Dock, other: Dock) -> DAffine3 {
    geometry::attached(place(one), place(other))
}

/// The dock's place on the module.
fn place(dock: Dock) -> geometry::Dock {
    geometry::Dock::ALL[usize::from(dock.index())]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Shape;
    use Dock::{Back, Down, Front, Left, Right, Up};
    use hormone::action::{Action, Posture};

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
                let angles = |module| [10.0 * module as f64, 20.0, -30.0];
                let poses = wiring.poses(0, &angles, &mut [false; 2]);
                let [(0, _), (1, pose)] = poses[..] else { panic!("both are found") };
                let frame = pose * dock([10.0, 20.0, -30.0], other);
                let fitting = dock([0.0, 20.0, -30.0], one) * attached(one, other);
                assert!(frame.abs_diff_eq(fitting, 1e-9), "{one:?} {other:?}");
            }
        }
    }

    /// A head, a branch with its legs, a tail.
    fn with_legs() -> Wiring {
        let pairs = [
            ((0, Back), (1, Front)),
            ((1, Left), (2, Back)),
            ((1, Right), (3, Back)),
            ((1, Back), (4, Front)),
        ];
        let mut wiring = Wiring::new(5);
        for ((one, dock), (other, its)) in pairs {
            wiring.attach(face(one, dock), face(other, its)).unwrap();
        }
        wiring
    }

    /// The angles of [`with_legs`] while both legs are in this posture of a left leg.
    fn in_posture(posture: Posture) -> impl Fn(usize) -> Angles {
        let Posture { motor0, roll, motor2 } = posture;
        move |module| match module {
            2 => [motor0, roll, motor2].map(f64::from),
            3 => [motor0, -roll, motor2].map(f64::from),
            _ => [0.0; 3],
        }
    }

    /// Where both feet are, seen from the branch.
    fn feet(posture: Posture) -> [DVec3; 2] {
        let angles = in_posture(posture);
        let poses = with_legs().poses(1, &angles, &mut [false; 5]);
        [2, 3].map(|leg| {
            let (_, pose) = poses.iter().find(|(module, _)| *module == leg).unwrap();
            (*pose * dock(angles(leg), Front)).translation
        })
    }

    #[test]
    fn a_swing_lifts_the_foot_and_brings_it_ahead_and_down_on_both_sides_and_on_the_back() {
        for (action, sign) in [(Action::Swing, 1.0), (Action::SwingOver, -1.0)] {
            let steps: Vec<[DVec3; 2]> = action.motion().iter().map(feet).collect();
            for leg in [0, 1] {
                let [from, .., lifted, to] = [0, 1, 2, 3].map(|step| steps[step][leg]);
                assert!(from.z.abs() < 1e-9 && lifted.z.abs() < 1e-9, "{action:?}");
                assert!(to.z * sign < -10.0, "{action:?} down");
                assert!(to.x - from.x > 50.0, "{action:?} ahead");
            }
            assert!((steps[0][0].y + steps[0][1].y).abs() < 1e-9, "one is the other in a mirror");
        }
    }

    #[test]
    fn a_leg_is_upside_down_with_the_body_whatever_it_does() {
        let actions = [Action::Swing, Action::SwingOver, Action::Holding, Action::HoldingOver];
        for posture in actions.iter().flat_map(|action| action.motion().iter()) {
            for (roll, sign) in [(0.0, 1.0), (180.0, -1.0), (-180.0, -1.0)] {
                let read = with_legs().accelerations(roll, in_posture(posture));
                for (module, [x, y, z]) in read.into_iter().enumerate() {
                    let least = if [2, 3].contains(&module) { 0.88 } else { 0.999 };
                    assert!(z * sign > least, "module {module}: {z} at {roll}");
                    assert!((x * x + y * y + z * z - 1.0).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn a_body_on_its_right_side_has_left_above() {
        let read = with_legs().accelerations(90.0, in_posture(Posture { motor0: 0, roll: 90, motor2: 0 }));
        for (module, up) in [(0, DVec3::Y), (1, DVec3::Y), (2, DVec3::X), (3, DVec3::NEG_X)] {
            assert!(DVec3::from(read[module]).abs_diff_eq(up, 1e-9), "module {module}: {:?}", read[module]);
        }
    }

    #[test]
    fn each_body_lies_by_itself() {
        let mut wiring = with_legs();
        wiring.detach(face(2, Back)).unwrap();
        let read = wiring.accelerations(0.0, |_| [30.0, 90.0, 0.0]);
        for module in [0, 2] {
            assert!((read[module][2] - 30_f64.to_radians().cos()).abs() < 1e-9, "module {module}");
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
