//! Release: stay curled, and open the latch of the Front.

use tasks::dock::Dock;

use super::{Docking, posture};

motion![posture(30, 0, 30); Docking::Release(Dock::Front)];
