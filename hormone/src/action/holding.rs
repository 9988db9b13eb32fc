//! Holding (Table 1): the foot stays on the ground "while rotating the hip to compensate the swing actions of
//! other legs".

use super::posture;

motion![posture(0, 90, 20), posture(0, 90, 10), posture(0, 90, 0), posture(0, 90, -10), posture(0, 90, -20)];
