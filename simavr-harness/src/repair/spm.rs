//! "Store Program Memory Ready" (ATmega128 datasheet, "Boot Loader Support", SPMCSR): the interrupt lasts as
//! long as SPMIE enables it and no SPM is under way. simavr raises it never, and does not know it as a level.
//!
//! Simplified: no program here writes its own flash, so an SPM is never under way. Whether the interrupt
//! comes while the EEPROM is written the datasheet does not say; those of sibling parts say that it does not.

use crate::cpu::{Cpu, Vector};
use crate::device::{Attached, Device, make_plain};
use crate::part::SpmRegisters;
use crate::repair::interrupt;

/// SPMCSR: the interrupt is enabled.
const SPMIE: u8 = 0x80;

/// EECR: a write is under way.
const EEWE: u8 = 0x02;

pub(crate) struct Spm {
    spmcsr: u16,
    ready: Vector,
    /// EECR, where a write to the EEPROM holds the interrupt up.
    pub waits_for: Option<u16>,
}

/// Puts the harness's register in the place of simavr's. `None`: the part has no such vector.
pub(crate) fn attach(cpu: Cpu, registers: &SpmRegisters) -> Option<Attached<Spm>> {
    let &SpmRegisters { spmcsr, ready } = registers;
    let spm = Spm { spmcsr, ready: cpu.vector(ready)?, waits_for: None };
    make_plain(cpu, &[spmcsr]);
    Some(Attached::new(cpu, spm, &[spmcsr], &[]))
}

impl Spm {
    /// Makes the interrupt pending, or no longer so.
    pub fn refresh(&self, cpu: Cpu) {
        let is_held_up = self.waits_for.is_some_and(|eecr| cpu.data(eecr) & EEWE != 0);
        interrupt::set_pending(cpu, self.ready, cpu.data(self.spmcsr) & SPMIE != 0 && !is_held_up);
    }
}

impl Device for Spm {
    fn write(&mut self, cpu: Cpu, address: u16, value: u8) {
        cpu.set_data(address, value & SPMIE);
        self.refresh(cpu);
    }
}
