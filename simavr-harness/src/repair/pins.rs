//! PINx of the ATmega128 can only be read (chapter "I/O Ports"). simavr has a write to it toggle PORTx, as
//! later parts do.

use crate::cpu::Cpu;
use crate::device::ignore_writes;

pub(crate) fn install(cpu: Cpu, read_only: &[u16]) {
    for &address in read_only {
        ignore_writes(cpu, address);
    }
}
