//! What neither simavr nor the harness has of the ATmega128. A program that switches it on crashes with the
//! reason, rather than go on as if it were off.

use crate::cpu::Cpu;
use crate::device::WrappedWrites;

/// Data address, bits that switch it on, and the reason.
const ABSENT: [(u16, u8, &str); 3] = [
    (0x55, 0x80, "SRE set in MCUCR: external memory is not simulated"),
    (0x55, 0x02, "IVSEL set in MCUCR: vectors in the boot section are not simulated"),
    (0x5c, 0x80, "XDIVEN set in XDIV: a divided clock is not simulated"),
];

pub(crate) fn install(cpu: Cpu, wrapped: &mut WrappedWrites) {
    for (address, bits, reason) in ABSENT {
        wrapped.wrap(cpu, address, move |cpu, _, _, written| {
            if written & bits != 0 {
                cpu.report(reason);
            }
        });
    }
}
