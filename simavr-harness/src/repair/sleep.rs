//! The sleep modes of the ATmega128 (chapter "Power Management and Sleep Modes"). simavr has idle alone. In
//! the others clocks stop that devices here keep, so a program that chooses one crashes as it goes to sleep.

use crate::cpu::Cpu;

const MCUCR: u16 = 0x55;
const SE: u8 = 0x20;
/// SM1, SM0 and SM2.
const MODE: u8 = 0x1c;

/// The core goes to sleep.
pub(crate) fn check(cpu: Cpu) {
    let control = cpu.data(MCUCR);
    if control & SE != 0 && control & MODE != 0 {
        cpu.report("SLEEP in another mode than idle, which alone is simulated");
    }
}
