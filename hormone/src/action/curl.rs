//! Curl: a sixth of a circle. Six modules that curl have their ends together.

use super::posture;

motion![posture(30, 0, 30)];
