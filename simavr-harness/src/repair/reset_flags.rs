//! The reset flags of MCUCSR, which is MCUSR on later parts (chapter "System Control and Reset"): a program
//! clears them by zeros, and can't set them. simavr stores what is written.

use crate::cpu::Cpu;
use crate::device::WrappedWrites;

/// JTRF, WDRF, BORF, EXTRF and PORF, which have the same places on all parts.
const FLAGS: u8 = 0x1f;

pub(crate) fn install(cpu: Cpu, wrapped: &mut WrappedWrites) {
    let [power_on, ..] = cpu.reset_flags();
    wrapped.wrap(cpu, power_on.address, |cpu, address, before, written| {
        cpu.set_data(address, written & (before | !FLAGS));
    });
}
