//! A rolling track's bend: in step s of 6 each joint is at 30 - 30 cos(s pi / 3) degrees, Motor2 a step ahead
//! of Motor0, as it is the next joint of the ring. The twelve joints of six modules carry two waves, and
//! their angles add up to 360 degrees.

use super::posture;

motion![
    posture(0, 0, 15),
    posture(15, 0, 45),
    posture(45, 0, 60),
    posture(60, 0, 45),
    posture(45, 0, 15),
    posture(15, 0, 0)
];
