//! Actions of a module's motors: each is a motion of the three joints, in a file of its own.
//!
//! A motion is a sequence of postures, spread evenly over the beats that the action takes. The joints hold
//! the last one until the next action. To add an action, write its file and add its line to the registry at
//! the end of this one.

use kernel::flash::Flash;
use tasks::dock::Dock;

/// Target angles of the three joints, in degrees, -127..=127.
///
/// At roll 0 Motor0 and Motor2 bend the module in one plane. Positive angles bend both halves towards Up.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Posture {
    /// The joint of the half with the Front dock.
    pub motor0: i8,
    /// The joint between the halves.
    pub roll: i8,
    /// The joint of the half with the Back dock. In a leg it is the hip.
    pub motor2: i8,
}

/// A [`Posture`], in the order of the motors' numbers.
pub const fn posture(motor0: i8, roll: i8, motor2: i8) -> Posture {
    Posture { motor0, roll, motor2 }
}

/// The postures of an action. If it has none, the joints stay where they are.
pub type Motion = Flash<[Posture]>;

/// An action's request to a dock, beside its motion.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Docking {
    /// Find the dock that comes near this one, and latch.
    Approach(Dock),
    /// Open this dock's latch.
    Release(Dock),
}

/// Declares the motion of an action's file, and what it wants of a dock.
macro_rules! motion {
    ($($posture:expr),* $(; $docking:expr)?) => {
        /// What the action wants of a dock.
        pub const DOCKING: Option<$crate::action::Docking> = $crate::action::first(&[$($docking)?]);

        const POSTURES: &[$crate::action::Posture] = &[$($posture),*];
        kernel::flash! {
            /// The action's postures.
            pub static MOTION: [$crate::action::Posture; POSTURES.len()] = $crate::rows::array(POSTURES);
        }
    };
}

const fn first(dockings: &[Docking]) -> Option<Docking> {
    match dockings {
        [docking, ..] => Some(*docking),
        [] => None,
    }
}

/// Declares [`Action`] and the modules of its motions.
macro_rules! actions {
    ($($(#[$attribute:meta])* $name:ident = $code:literal in $file:ident,)*) => {
        $(mod $file;)*

        /// A local action.
        #[derive(Clone, Copy, PartialEq, Eq)]
        #[cfg_attr(not(target_arch = "avr"), derive(Debug))]
        #[repr(u8)]
        pub enum Action {
            $($(#[$attribute])* $name = $code,)*
        }

        impl Action {
            /// The action with code `byte`, as [`Status`](crate::status::Status) carries it.
            pub const fn from_byte(byte: u8) -> Option<Action> {
                match byte {
                    $($code => Some(Action::$name),)*
                    _ => None,
                }
            }

            /// The postures that make up the action.
            pub fn motion(self) -> &'static Motion {
                match self {
                    $(Action::$name => &$file::MOTION,)*
                }
            }

            /// What the action wants of a dock.
            pub const fn docking(self) -> Option<Docking> {
                match self {
                    $(Action::$name => $file::DOCKING,)*
                }
            }
        }
    };
}

actions! {
    /// All motors at 0 degrees.
    Straight = 0 in straight,
    /// Lift the leg, swing it forward, put it down.
    Swing = 1 in swing,
    /// Hold the leg on the ground while the hip turns back under the swing of the others.
    Holding = 2 in holding,
    /// Keep still: the safe action of a module to which no rule has given another.
    Rest = 3 in rest,
    /// A vertical wave of the body.
    Wave = 4 in wave,
    /// A wave of the body in the plane of the ground.
    Undulate = 5 in undulate,
    /// Bend as a part of a rolling track.
    Roll = 6 in roll,
    /// Bend as a sixth of a circle.
    Curl = 7 in curl,
    /// Bend as a sixth of a circle, and latch what comes near the Back.
    Grasp = 8 in grasp,
    /// Bend as a sixth of a circle, and let go of the neighbour in front.
    Release = 9 in release,
    /// Swing on the back: lift the leg the other way.
    SwingOver = 10 in swing_over,
    /// Hold on the back: press the foot down to the other side.
    HoldingOver = 11 in holding_over,
    /// Crawl as a module alone.
    Inch = 12 in inch,
    /// Bend as a sixth of a circle, and latch what comes near the Front.
    Reach = 13 in reach,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> impl Iterator<Item = Action> {
        (0..=u8::MAX).filter_map(Action::from_byte)
    }

    #[test]
    fn every_action_survives_its_byte() {
        for byte in 0..=u8::MAX {
            assert!(Action::from_byte(byte).is_none_or(|action| action as u8 == byte));
        }
        assert!(all().all(|action| (action as u8) < 16), "an event has four bits for it");
    }

    #[test]
    fn no_joint_is_sent_past_its_end() {
        // Pitch and yaw turn 90 degrees each way; roll turns farther than an `i8` can say.
        for frame in all().flat_map(|action| action.motion().iter()) {
            assert!(frame.motor0.abs() <= 90 && frame.motor2.abs() <= 90);
            assert_ne!(frame.roll, i8::MIN, "the other sign can be taken");
        }
    }

    #[test]
    fn a_swing_ends_where_holding_begins_and_the_other_way_round() {
        let ends = |action: Action| {
            let postures: Vec<Posture> = action.motion().iter().collect();
            (postures[0], postures[postures.len() - 1])
        };
        assert_eq!(ends(Action::Swing).1, ends(Action::Holding).0);
        assert_eq!(ends(Action::Swing).0.motor2, ends(Action::Holding).1.motor2);
        assert!(ends(Action::Swing).0.motor0 > ends(Action::Holding).1.motor0, "lifted first");
    }

    #[test]
    fn on_its_back_a_leg_is_lifted_the_other_way_and_the_hip_turns_as_before() {
        for (usual, over) in [(Action::Swing, Action::SwingOver), (Action::Holding, Action::HoldingOver)] {
            let mirrored = |up: Posture| posture(-up.motor0, 90 + (90 - up.roll), up.motor2);
            assert!(usual.motion().iter().map(mirrored).eq(over.motion().iter()));
        }
    }

    #[test]
    fn six_that_curl_make_a_circle() {
        for action in [Action::Curl, Action::Grasp, Action::Reach, Action::Release] {
            let bends = action.motion().iter().map(|posture| posture.motor0 + posture.motor2);
            assert!(bends.eq([60]), "a sixth of 360 degrees");
        }
    }

    #[test]
    fn grasp_reach_and_release_want_something_of_a_dock() {
        assert_eq!(Action::Grasp.docking(), Some(Docking::Approach(Dock::Back)));
        assert_eq!(Action::Reach.docking(), Some(Docking::Approach(Dock::Front)));
        assert_eq!(Action::Release.docking(), Some(Docking::Release(Dock::Front)));
        assert_eq!(Action::Curl.docking(), None);
    }
}
