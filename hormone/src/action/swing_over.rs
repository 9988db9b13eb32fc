//! A swing of a leg that lies on its back, as when the robot is turned over: the foot is lifted to the other
//! side. The hip turns as in [`swing`](super::swing), for left, right and ahead are the body's own.

use super::posture;

motion![posture(-30, 90, -20), posture(-30, 90, 0), posture(-30, 90, 20), posture(0, 90, 20)];
