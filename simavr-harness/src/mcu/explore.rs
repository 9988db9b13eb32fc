//! Runs an MCU on from one moment in many ways.

use super::Mcu;
use crate::device::Attached;

impl Mcu {
    /// Runs `trial` on the MCU, then restores the MCU to this moment. Returns the result of `trial`.
    ///
    /// Flash, EEPROM, the converter, and the state of the serial links and the two-wire bus are not restored:
    /// this is for programs that leave those alone.
    ///
    /// # Panics
    /// When `trial` replaces this MCU with another one.
    pub fn explore<R>(&mut self, trial: impl FnOnce(&mut Self) -> R) -> R {
        let core = self.cpu.snapshot();
        let markers = self.markers.get();
        let (log, stop) = (markers.log.clone(), markers.stop);
        let timers: Vec<_> = self.timers.iter().map(Attached::save).collect();
        let external = self.external.as_ref().map(Attached::save);
        let random = self.random.clone();
        let (awake_cycles, asleep, resets) = (self.awake_cycles, self.asleep, self.resets);
        let (starts_at, hangs_at, enabled_just_now) = (self.starts_at, self.hangs_at, self.enabled_just_now);
        let ended = self.ended.clone();
        let result = trial(self);
        self.cpu.restore(core);
        self.markers.with(self.cpu, |markers| (markers.log, markers.stop) = (log, stop));
        self.timers.iter_mut().zip(timers).for_each(|(timer, saved)| timer.restore(saved));
        if let (Some(external), Some(saved)) = (&mut self.external, external) {
            external.restore(saved);
        }
        self.random = random;
        (self.awake_cycles, self.asleep, self.resets) = (awake_cycles, asleep, resets);
        (self.starts_at, self.hangs_at, self.enabled_just_now) = (starts_at, hangs_at, enabled_just_now);
        self.ended = ended;
        result
    }
}
