//! "Store Program Memory Ready" (ATmega128 datasheet, "Boot Loader Support", SPMCSR): the interrupt lasts as
//! long as SPMIE enables it and no SPM is under way. simavr raises it never, and does not know it as a level.
//!
//! Simplified: no program here writes its own flash, so an SPM is never under way.

use crate::cpu::{Cpu, Vector};
use crate::device::{Attached, Device, make_plain};
use crate::part::SpmRegisters;
use crate::repair::interrupt;

/// SPMCSR: the interrupt is enabled.
const SPMIE: u8 = 0x80;

pub(crate) struct Spm {
    spmcsr: u16,
    ready: Vector,
}

/// Puts the harness's register in the place of simavr's. `None`: the part has no such vector.
pub(crate) fn attach(cpu: Cpu, registers: &SpmRegisters) -> Option<Attached<Spm>> {
    let &SpmRegisters { spmcsr, ready } = registers;
    let spm = Spm { spmcsr, ready: cpu.vector(ready)? };
    make_plain(cpu, &[spmcsr]);
    Some(Attached::new(cpu, spm, &[spmcsr], &[]))
}

impl Spm {
    /// Makes the interrupt pending, or no longer so.
    pub fn refresh(&self, cpu: Cpu) {
        interrupt::set_pending(cpu, self.ready, cpu.data(self.spmcsr) & SPMIE != 0);
    }
}

impl Device for Spm {
    fn write(&mut self, cpu: Cpu, address: u16, value: u8) {
        cpu.set_data(address, value & SPMIE);
        self.refresh(cpu);
    }
}
