//! Registers whose reads have no meaning here: a program that reads one crashes with the reason, rather than
//! go on with what memory holds there.

use crate::cpu::Cpu;
use crate::device::{Attached, Device};

pub(crate) struct Unread {
    reason: &'static str,
}

/// Has reads of `registers`, which are memory otherwise, end the program for this reason.
pub(crate) fn attach(cpu: Cpu, registers: &[u16], reason: &'static str) -> Attached<Unread> {
    Attached::new(cpu, Unread { reason }, &[], registers)
}

impl Device for Unread {
    fn write(&mut self, _cpu: Cpu, _address: u16, _value: u8) {
        // Writes stay as they are.
    }

    fn read(&mut self, cpu: Cpu, address: u16) -> u8 {
        cpu.report(self.reason);
        cpu.data(address)
    }
}
