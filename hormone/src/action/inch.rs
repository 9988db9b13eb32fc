//! The crawl of a module alone: in step s of 16 Motor0 is at 30 cos(s pi / 8) degrees and Motor2, three
//! eighths of the Period ahead of it, at 30 cos((s + 6) pi / 8). One end presses on the ground while the
//! other is brought ahead: of the amplitudes and phases that were tried in the world, these carry the module
//! far, and straight.
//!
//! To turn left the module rolls by 20 degrees in step with Motor2, so that it brings each end ahead on its
//! left edge and back on its right one; see [`Controller::posture`](crate::controller::Controller::posture).

use super::posture;

motion![
    posture(30, -14, -21),
    posture(28, -18, -28),
    posture(21, -20, -30),
    posture(11, -18, -28),
    posture(0, -14, -21),
    posture(-11, -8, -11),
    posture(-21, 0, 0),
    posture(-28, 8, 11),
    posture(-30, 14, 21),
    posture(-28, 18, 28),
    posture(-21, 20, 30),
    posture(-11, 18, 28),
    posture(0, 14, 21),
    posture(11, 8, 11),
    posture(21, 0, 0),
    posture(28, -8, -11)
];
