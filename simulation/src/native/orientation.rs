//! How the modules of the robot lie, as their accelerometers tell if there is no world: with joints that are
//! where they were told to be.

use super::Native;
use crate::hardware::MILLISECOND;

/// How often the accelerometers are updated, in cycles. They are updated at once when the robot is turned.
pub const SAMPLE_PERIOD: u64 = 250 * MILLISECOND;

impl Native {
    /// Has all modules feel how they lie now, unless a world shows them.
    pub(super) fn feel(&mut self) {
        if self.world.is_some() {
            return;
        }
        let accelerations = self.wiring.accelerations(self.roll, |module| self.modules[module].angles());
        for (module, acceleration) in self.modules.iter_mut().zip(accelerations) {
            module.feel(acceleration);
        }
    }
}
