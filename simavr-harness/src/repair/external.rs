//! External interrupts at the pins of compare units (chapter "External Interrupts"). Edges of the pin raise
//! them, whether the compare unit or the outside makes the edges. simavr passes an interrupt the level from a
//! compare unit together with a flag, and so misses the rising edges.

use crate::cpu::Cpu;

/// The pins with both functions, OC3B and OC3C, by their bits in port E, which are the numbers of their
/// interrupts, too.
const PINS: [u8; 2] = [4, 5];

/// Call it after each reset, in which simavr connects its own signals again.
pub(crate) fn install(cpu: Cpu) {
    for pin in PINS {
        cpu.show_external_interrupt_levels_only('E', pin);
    }
}
