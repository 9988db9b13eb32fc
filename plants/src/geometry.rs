//! A module as rigid bodies: the positions of its joints and docks.
//!
//! A module is two cubes in a row (Salemi, Moll and Shen, 2006). In the middle of each a joint bends it, and
//! between them a third joint rolls. The frame of a module has its origin between the cubes; x points to the
//! Front, y to the Left, z to the Up of a straight module. Lengths are in mm.

use std::f64::consts::FRAC_PI_2;

use glam::{DAffine3, DMat3, DQuat, DVec3};

/// The edge of a cube, in mm: a module is 168 mm long (Salemi, Moll and Shen, 2006).
pub const EDGE: f64 = 84.0;

/// The angles of a module's three joints, in degrees: Motor0, which bends the half with the Front dock, the
/// roll between the halves, Motor2.
pub type Angles = [f64; 3];

/// A dock, in the order of the docks' indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dock {
    Front,
    Back,
    Left,
    Right,
    Up,
    Down,
}

impl Dock {
    pub const ALL: [Dock; 6] = [Dock::Front, Dock::Back, Dock::Left, Dock::Right, Dock::Up, Dock::Down];

    /// The half that carries the dock.
    pub fn half(self) -> Half {
        match self {
            Dock::Front | Dock::Left | Dock::Right => Half::Front,
            Dock::Back | Dock::Up | Dock::Down => Half::Back,
        }
    }

    /// The frame of the dock in that of its half. Its origin is in the middle of the dock's face, and x
    /// points outwards. z coincides with z of the dock that is attached to it, except for a [quarter
    /// turn](attached). z of all docks round a module points to its Up, z of Up and Down to its Front.
    pub fn in_half(self) -> DAffine3 {
        let [outwards, up] = match self {
            Dock::Front => [DVec3::X, DVec3::Z],
            Dock::Back => [DVec3::NEG_X, DVec3::Z],
            Dock::Left => [DVec3::Y, DVec3::Z],
            Dock::Right => [DVec3::NEG_Y, DVec3::Z],
            Dock::Up => [DVec3::Z, DVec3::X],
            Dock::Down => [DVec3::NEG_Z, DVec3::X],
        };
        let orientation = DMat3::from_cols(outwards, up.cross(outwards), up);
        DAffine3::from_mat3(orientation) * DAffine3::from_translation(DVec3::X * (EDGE / 2.0))
    }

    /// The frame of the dock in that of its module.
    pub fn in_module(self, angles: Angles) -> DAffine3 {
        self.half().in_module(angles) * self.in_half()
    }
}

/// A half of a module: the part that turns about Motor0, or about Motor2. The master's board, and with it the
/// accelerometer, is in the front half.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Half {
    Front,
    Back,
}

impl Half {
    /// The frame of the half in that of its module. Its origin is in the middle of the cube, on the joint's
    /// axis. Positive angles bend both halves towards Up.
    pub fn in_module(self, angles: Angles) -> DAffine3 {
        let [front, roll, back] = angles.map(f64::to_radians);
        let at = DVec3::X * (EDGE / 2.0);
        match self {
            Half::Front => DAffine3::from_translation(at) * DAffine3::from_rotation_y(-front),
            Half::Back => {
                DAffine3::from_rotation_x(roll)
                    * DAffine3::from_translation(-at)
                    * DAffine3::from_rotation_y(back)
            }
        }
    }
}

/// The transformation from a dock's frame to that of a dock attached to it. A Back is attached to a Left or a
/// Right with a quarter turn, as a leg is. The leg's hip turns about z of the body. Its half with the Front
/// dock has its Up where the body has it when a left leg is rolled by 90 degrees, a right one by -90: the two
/// are mirror images.
pub fn attached(one: Dock, other: Dock) -> DAffine3 {
    let opposite = DMat3::from_diagonal(DVec3::new(-1.0, -1.0, 1.0));
    let turn = match (one, other) {
        (Dock::Back, Dock::Left) | (Dock::Left, Dock::Back) => FRAC_PI_2,
        (Dock::Back, Dock::Right) | (Dock::Right, Dock::Back) => -FRAC_PI_2,
        _ => 0.0,
    };
    DAffine3::from_mat3(DMat3::from_rotation_x(turn) * opposite)
}

/// The position of one dock before another: the distance between their middles in mm, and the angle in
/// degrees, in any direction, by which it is turned from where it would fit. `None` if it faces away from the
/// other, or lies behind it. Frames of both docks are in mm.
pub fn before((one, frame): (Dock, DAffine3), (other, there): (Dock, DAffine3)) -> Option<(f64, f64)> {
    // The pose of `there` relative to where it would fit.
    let off = (frame * attached(one, other)).inverse() * there;
    let degrees = DQuat::from_mat3(&off.matrix3).angle_between(DQuat::IDENTITY).to_degrees();
    let is_behind = off.translation.x > EDGE / 2.0;
    (degrees < 90.0 && !is_behind).then_some((off.translation.length(), degrees))
}

#[cfg(test)]
mod tests {
    use super::*;
    use Dock::{Back, Down, Front, Left, Right, Up};

    const STRAIGHT: Angles = [0.0; 3];
    const MIDDLE: f64 = EDGE / 2.0;

    /// Fails where the middle of the dock's face is not here, or the dock points elsewhere.
    fn expect_place(dock: Dock, angles: Angles, at: DVec3, outwards: DVec3) {
        let frame = dock.in_module(angles);
        let (is_at, points) = (frame.translation, frame.transform_vector3(DVec3::X));
        assert!(is_at.abs_diff_eq(at, 1e-9), "{dock:?} at {angles:?} is at {is_at}, not at {at}");
        assert!(points.abs_diff_eq(outwards, 1e-9), "{dock:?} at {angles:?} points to {points}");
    }

    #[test]
    fn docks_are_in_the_middle_of_the_faces_of_two_cubes_in_a_row() {
        for (dock, cube, outwards) in [
            (Front, MIDDLE, DVec3::X),
            (Back, -MIDDLE, DVec3::NEG_X),
            (Left, MIDDLE, DVec3::Y),
            (Right, MIDDLE, DVec3::NEG_Y),
            (Up, -MIDDLE, DVec3::Z),
            (Down, -MIDDLE, DVec3::NEG_Z),
        ] {
            expect_place(dock, STRAIGHT, DVec3::X * cube + outwards * MIDDLE, outwards);
        }
    }

    #[test]
    fn positive_angles_bend_both_halves_up_and_roll_the_half_behind_to_the_right() {
        expect_place(Front, [90.0, 0.0, 0.0], DVec3::new(MIDDLE, 0.0, MIDDLE), DVec3::Z);
        expect_place(Back, [0.0, 0.0, 90.0], DVec3::new(-MIDDLE, 0.0, MIDDLE), DVec3::Z);
        expect_place(Up, [0.0, 90.0, 0.0], DVec3::new(-MIDDLE, -MIDDLE, 0.0), DVec3::NEG_Y);
        expect_place(Front, [0.0, 90.0, 0.0], DVec3::X * EDGE, DVec3::X);
    }

    #[test]
    fn docks_that_are_attached_face_each_other_from_whichever_side() {
        for (one, other) in Dock::ALL.into_iter().flat_map(|one| Dock::ALL.map(|other| (one, other))) {
            let there = attached(one, other);
            assert!(there.transform_vector3(DVec3::X).abs_diff_eq(DVec3::NEG_X, 1e-9), "{one:?} {other:?}");
            let back = attached(other, one) * there;
            assert!(back.abs_diff_eq(DAffine3::IDENTITY, 1e-9), "{one:?} {other:?}");
        }
    }

    #[test]
    fn the_hip_of_a_leg_turns_about_the_bodys_z_and_its_front_half_has_the_bodys_up_when_it_is_rolled() {
        for (side, roll) in [(Left, 90.0), (Right, -90.0)] {
            let leg = |roll| {
                side.in_module(STRAIGHT) * attached(side, Back) * Back.in_module([0.0, roll, 0.0]).inverse()
            };
            let hip = leg(0.0).transform_vector3(DVec3::Y);
            assert!(hip.z.abs() > 1.0 - 1e-9, "{side:?}: {hip}");
            let up = leg(roll).transform_vector3(DVec3::Z);
            assert!(up.abs_diff_eq(DVec3::Z, 1e-9), "{side:?}: {up}");
        }
    }

    /// The position of a Front before a Back that is `off` from where it would fit.
    fn before_at(off: DAffine3) -> Option<(f64, f64)> {
        let frame = DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0)) * DAffine3::from_rotation_z(1.0);
        before((Front, frame), (Back, frame * attached(Front, Back) * off))
    }

    #[test]
    fn a_dock_is_before_another_that_faces_it_as_far_and_as_much_askew_as_it_is_off() {
        let off = |x, y, degrees: f64| {
            DAffine3::from_translation(DVec3::new(x, y, 0.0))
                * DAffine3::from_rotation_y(degrees.to_radians())
        };
        for (x, y, degrees) in [(0.0, 0.0, 0.0), (-3.0, 4.0, 0.0), (0.0, 0.0, 20.0), (-30.0, 40.0, -89.0)] {
            let (distance, askew) = before_at(off(x, y, degrees)).expect("it faces it");
            assert!((distance - x.hypot(y)).abs() < 1e-9, "{distance}");
            assert!((askew - degrees.abs()).abs() < 1e-5, "{askew}");
        }
        assert_eq!(before_at(off(0.0, 0.0, 91.0)), None, "it faces away");
        assert!(before_at(off(MIDDLE - 0.1, 0.0, 0.0)).is_some(), "bodies press into each other a little");
        assert_eq!(before_at(off(MIDDLE + 0.1, 0.0, 0.0)), None, "it is behind");
    }
}
