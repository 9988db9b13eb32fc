//! What neither simavr nor the harness has of the ATmega128. A program that switches it on crashes with the
//! reason, rather than go on as if it were off.

use crate::cpu::Cpu;
use crate::device::WrappedWrites;

/// Data address, bits that switch it on, and the reason.
const ABSENT: [(u16, u8, &str); 8] = [
    (0x55, 0x80, "SRE set in MCUCR: external memory is not simulated"),
    (0x55, 0x02, "IVSEL set in MCUCR: vectors in the boot section are not simulated"),
    (0x5c, 0x80, "XDIVEN set in XDIV: a divided clock is not simulated"),
    (0x50, 0x08, "AS0 set in ASSR: a crystal at TOSC1 and TOSC2 is not simulated"),
    (0x40, 0x80, "TSM set in SFIOR: timers that are held are not simulated"),
    (0x40, 0x08, "ACME set in SFIOR: the analog comparator is not simulated"),
    (0x40, 0x04, "PUD set in SFIOR: pull-ups that are all off are not simulated"),
    (0x28, 0x4c, "ACBG, ACIE or ACIC set in ACSR: the analog comparator is not simulated"),
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
