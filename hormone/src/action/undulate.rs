//! The serpentine's wave: the body lies on its side, so that Motor0 and Motor2 bend it in the plane of the
//! ground. In step s of 16 they are at 30 cos(s pi / 8) and, half a module behind, 30 cos((s + 2) pi / 8)
//! degrees.

use super::posture;

motion![
    posture(30, 0, 21),
    posture(28, 0, 11),
    posture(21, 0, 0),
    posture(11, 0, -11),
    posture(0, 0, -21),
    posture(-11, 0, -28),
    posture(-21, 0, -30),
    posture(-28, 0, -28),
    posture(-30, 0, -21),
    posture(-28, 0, -11),
    posture(-21, 0, 0),
    posture(-11, 0, 11),
    posture(0, 0, 21),
    posture(11, 0, 28),
    posture(21, 0, 30),
    posture(28, 0, 28)
];
