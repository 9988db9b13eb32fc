//! PINx of the ATmega128 is read-only (chapter "I/O Ports"). In simavr a write to it toggles PORTx, as on
//! later parts.

use crate::cpu::Cpu;
use crate::device::ignore_writes;

pub(crate) fn install(cpu: Cpu, read_only: &[u16]) {
    for &address in read_only {
        ignore_writes(cpu, address);
    }
}
