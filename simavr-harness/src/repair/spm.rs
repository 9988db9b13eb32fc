//! "Store Program Memory Ready" (ATmega128 datasheet, "Boot Loader Support", SPMCSR): the interrupt lasts as
//! long as SPMIE enables it and no SPM is under way. simavr never raises it, and does not treat it as a
//! level.
//!
//! No program here can write its own flash, nor read fuses and lock bits: one that sets SPMEN to do so
//! crashes. So an SPM is never under way. The datasheet leaves open how a write to the EEPROM affects the
//! interrupt: see [`WhileWriting`].

use crate::cpu::{Cpu, Vector};
use crate::device::{Attached, Device, make_plain};
use crate::part::SpmRegisters;
use crate::repair::eeprom::EEWE;
use crate::repair::interrupt;

/// SPMCSR: the interrupt is enabled.
const SPMIE: u8 = 0x80;

/// SPMCSR: what the next SPM or LPM does is chosen by the other bits.
const SPMEN: u8 = 0x01;

/// How a write to the EEPROM may affect "Store Program Memory Ready" on the chip while it lasts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WhileWriting {
    /// The interrupt does not come, as in the datasheets of sibling parts.
    Waits,
    /// SPMCSR stays as it is, whatever the program writes there ("EEPROM Write Prevents Writing to SPMCSR").
    KeepsRegister,
}

pub(crate) struct Spm {
    spmcsr: u16,
    ready: Vector,
    eecr: u16,
    pub while_writing: Option<WhileWriting>,
}

/// Replaces simavr's register by the harness's. `None`: the part has no such vector.
pub(crate) fn attach(cpu: Cpu, registers: &SpmRegisters, eecr: u16) -> Option<Attached<Spm>> {
    let &SpmRegisters { spmcsr, ready } = registers;
    let spm = Spm { spmcsr, ready: cpu.vector(ready)?, eecr, while_writing: None };
    make_plain(cpu, &[spmcsr]);
    Some(Attached::new(cpu, spm, &[spmcsr], &[]))
}

impl Spm {
    /// Makes the interrupt pending or not.
    pub fn refresh(&self, cpu: Cpu) {
        let is_held_up = self.is_affected(cpu, WhileWriting::Waits);
        interrupt::set_pending(cpu, self.ready, cpu.data(self.spmcsr) & SPMIE != 0 && !is_held_up);
    }

    fn is_affected(&self, cpu: Cpu, how: WhileWriting) -> bool {
        self.while_writing == Some(how) && cpu.data(self.eecr) & EEWE != 0
    }
}

impl Device for Spm {
    fn write(&mut self, cpu: Cpu, address: u16, value: u8) {
        if self.is_affected(cpu, WhileWriting::KeepsRegister) {
            return;
        }
        if value & SPMEN != 0 {
            cpu.report("SPMEN set in SPMCSR: self-programming is not simulated");
        }
        cpu.set_data(address, value & SPMIE);
        self.refresh(cpu);
    }
}
