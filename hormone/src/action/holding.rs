//! Holding (Table 1): the foot stays on the ground "while rotating the hip to compensate the swing actions of
//! other legs".
//!
//! Legs are no longer than the body is high, so the foot has to be pressed down for the body to leave the
//! ground. Motor0 at 20 degrees lifts it by 12 mm, and a roll of 20 degrees onto an edge by as much again. So
//! each joint turns half of the way, for a leg has an eighth of a second to take the load. The roll brings
//! the foot down backwards, as the hip moves it.

use super::posture;

motion![
    posture(-20, 70, 18),
    posture(-20, 70, 9),
    posture(-20, 70, 0),
    posture(-20, 70, -9),
    posture(-20, 70, -18)
];
