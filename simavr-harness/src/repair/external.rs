//! External interrupts at the pins of compare units (chapter "External Interrupts"): they come of the pin's
//! edges whoever makes them. simavr hands an interrupt the level that a compare unit gives to a pin with a
//! flag in it, and so misses the rising edges.

use crate::cpu::Cpu;

/// The pins that are both, all of port E, and the numbers of their interrupts: OC3B, OC3C.
const PINS: [u8; 2] = [4, 5];

/// To be done after each reset, at which simavr puts its own in place.
pub(crate) fn install(cpu: Cpu) {
    for pin in PINS {
        cpu.show_external_interrupt_levels_only('E', pin);
    }
}
