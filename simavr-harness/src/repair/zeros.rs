//! Bits of the ATmega128 that read 0 whatever a program writes there: those that the hardware clears at once,
//! those that nothing sets here, and reserved ones. In simavr they read what was written, and one of WDTCR
//! stops the watchdog's resets.

use crate::cpu::Cpu;
use crate::device::WrappedWrites;

/// Data address, and the bits that keep what is written.
const KEPT: [(u16, u8); 7] = [
    (0x28, 0xcf), // ACSR without ACI, which a one clears, and ACO
    (0x40, 0x8c), // SFIOR without PSR0 and PSR321
    (0x41, 0x1f), // WDTCR
    (0x50, 0x08), // ASSR without TCN0UB, OCR0UB and TCR0UB
    (0x55, 0xfe), // MCUCR without IVCE, which lasts for four cycles
    (0x64, 0x1f), // DDRG
    (0x65, 0x1f), // PORTG
];

pub(crate) fn install(cpu: Cpu, wrapped: &mut WrappedWrites) {
    for (address, kept) in KEPT {
        wrapped.replace(cpu, address, move |_, written| written & kept);
    }
}
