//! A swing of a leg that lies on its back, as when the robot is turned over: the foot is lifted, pressed down
//! and rolled to the other side. The hip turns as in [`swing`](super::swing), for left, right and ahead are
//! the body's own.

use super::posture;

motion![posture(0, 90, -18), posture(0, 90, 18), posture(0, 90, 18), posture(20, 110, 18)];
