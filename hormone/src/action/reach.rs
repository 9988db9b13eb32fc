//! Reach: curl, and latch the dock that comes near the Front.

use tasks::dock::Dock;

use super::{Docking, posture};

motion![posture(30, 0, 30); Docking::Approach(Dock::Front)];
