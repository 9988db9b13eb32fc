//! The swing of a leg that lies on its back because the robot is turned over: the foot is lifted, pressed
//! down and rolled to the other side. The hip turns as in [`swing`](super::swing), because left, right and
//! ahead are those of the body.

use super::posture;

motion![posture(0, 90, -18), posture(0, 90, 18), posture(0, 90, 18), posture(20, 110, 18)];
