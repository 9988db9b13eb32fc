//! SBI and CBI of the parts that came after the ATmega128 touch one bit alone, so SBI clears one flag of a
//! register of flags, and CBI none (chapter "AVR Memories", "I/O Memory"). In simavr both read and write the
//! whole register, as on the ATmega128.

use crate::cpu::Cpu;
use crate::device::{has_write_handler, write_single_ones};
use crate::part::Part;

/// Call it when all writes to the registers are handled.
pub(crate) fn install(cpu: Cpu, part: &Part) {
    for &address in part.other_flags {
        if has_write_handler(cpu, address) {
            write_single_ones(cpu, address);
        }
    }
}
