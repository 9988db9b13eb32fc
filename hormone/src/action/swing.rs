//! Swing (Table 1): "lift a leg module, swing the module forward, and then put the module down".
//!
//! A leg is attached a quarter turn round, and stands rolled by 90 degrees: its hip, Motor2, turns about the
//! vertical, and Motor0 lifts the foot. Straight and upright it is as low as the body. A swing ends with the
//! leg pressed down and rolled onto an edge, as [`holding`](super::holding) begins. The angles are those of a
//! left leg; see [`Controller::posture`](crate::controller::Controller::posture) for the right.

use super::posture;

motion![posture(0, 90, -18), posture(0, 90, 18), posture(0, 90, 18), posture(-20, 70, 18)];
