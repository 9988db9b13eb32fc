//! PINx of the ATmega128 is read-only (chapter "I/O Ports"). In simavr a write to it toggles PORTx, as on
//! later parts. Those have flags of pin changes. For SBI and CBI of another bit of their register, simavr
//! calls a null pointer.

use crate::cpu::Cpu;
use crate::device::{ignore_other_bits, ignore_writes};
use crate::part::Part;

pub(crate) fn install(cpu: Cpu, part: &Part) {
    for &address in part.read_only_pins {
        ignore_writes(cpu, address);
    }
    if let Some(address) = part.pin_change_flags {
        // SAFETY: simavr keeps a list of handlers for this register.
        unsafe { ignore_other_bits(cpu, address) };
    }
}
