//! What if: run on from one moment in many ways.

use super::Mcu;

impl Mcu {
    /// Lets `trial` do with the MCU what it likes, then takes the MCU back to this moment. Returns what
    /// `trial` did.
    ///
    /// Flash, EEPROM, the converter and what the MCU has on its serial links and its two-wire bus are not
    /// taken back: this is for programs that leave those alone.
    ///
    /// # Panics
    /// When `trial` puts another MCU in the place of this one.
    pub fn explore<R>(&mut self, trial: impl FnOnce(&mut Self) -> R) -> R {
        let core = self.cpu.snapshot();
        let markers = self.markers.get();
        let (log, stop) = (markers.log.clone(), markers.stop);
        let random = self.random.clone();
        let (awake_cycles, asleep, resets) = (self.awake_cycles, self.asleep, self.resets);
        let ended = self.ended.clone();
        let result = trial(self);
        self.cpu.restore(core);
        self.markers.with(self.cpu, |markers| (markers.log, markers.stop) = (log, stop));
        self.random = random;
        (self.awake_cycles, self.asleep, self.resets) = (awake_cycles, asleep, resets);
        self.ended = ended;
        result
    }
}
