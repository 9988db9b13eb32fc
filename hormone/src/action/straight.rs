//! Straight (Table 1): all motors at 0 degrees.

use super::posture;

motion![posture(0, 0, 0)];
