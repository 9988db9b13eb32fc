//! The EEPROM (chapter "EEPROM Data Memory"), in place of simavr's. A write takes its time; meanwhile the
//! EEPROM can't be read, nor the address changed. EE_READY lasts as long as no write is under way. The core
//! waits as the chip's does. Later parts than the ATmega128 can also erase or write alone.

use simulation::CLOCK_HZ;

use crate::cpu::{Cpu, Vector};
use crate::device::{Attached, Device, make_plain};
use crate::part::EepromRegisters;
use crate::repair::interrupt;

/// Cycles in a microsecond.
const MICRO: u64 = CLOCK_HZ as u64 / 1_000_000;

/// How long EEMWE stays set.
const MASTER_WRITE_CYCLES: u64 = 4;

/// Cycles that the core waits when it starts a write.
const WRITE_HALT: u64 = 2;

/// Cycles that the core waits when it reads.
const READ_HALT: u64 = 4;

// EECR
/// What a write does, on the later parts: both, or one of these.
const EEPM: u8 = 0x30;
const ERASE_ONLY: u8 = 0x10;
const WRITE_ONLY: u8 = 0x20;
const EERIE: u8 = 0x08;
const EEMWE: u8 = 0x04;
/// A write is under way.
pub const EEWE: u8 = 0x02;
const EERE: u8 = 0x01;

pub(crate) struct Eeprom {
    registers: &'static EepromRegisters,
    ready: Vector,
    contents: Vec<u8>,
    /// The last cycle in which EEWE starts a write.
    writable_until: Option<u64>,
    /// End of the write under way.
    writing_until: Option<u64>,
}

/// Replaces simavr's EEPROM by the harness's, erased. `None`: the part has no such vector.
pub(crate) fn attach(cpu: Cpu, registers: &'static EepromRegisters) -> Option<Attached<Eeprom>> {
    let &EepromRegisters { eecr, eearl, eearh, .. } = registers;
    let eeprom = Eeprom {
        registers,
        ready: cpu.vector(registers.ready)?,
        contents: vec![0xff; registers.size.into()],
        writable_until: None,
        writing_until: None,
    };
    make_plain(cpu, &[eecr]);
    Some(Attached::new(cpu, eeprom, &[eecr, eearl, eearh], &[]))
}

impl Eeprom {
    /// Sets the registers to their values after a reset. A write under way goes on.
    pub fn reset(&mut self, cpu: Cpu) {
        self.writable_until = None;
        let EepromRegisters { eecr, eedr, eearl, eearh, .. } = *self.registers;
        for address in [eedr, eearl, eearh] {
            cpu.set_data(address, 0);
        }
        cpu.set_data(eecr, if self.writing_until.is_some() { EEWE } else { 0 });
        self.refresh(cpu);
    }

    pub fn contents(&self) -> &[u8] {
        &self.contents
    }

    pub fn program(&mut self, address: u16, bytes: &[u8]) {
        let places = self.contents.iter_mut().skip(address.into());
        places.zip(bytes).for_each(|(place, byte)| *place = *byte);
    }

    /// Makes EE_READY pending or not: it lasts as long as it is enabled and no write is under way.
    pub fn refresh(&self, cpu: Cpu) {
        let control = cpu.data(self.registers.eecr);
        interrupt::set_pending(cpu, self.ready, control & EERIE != 0 && control & EEWE == 0);
    }

    fn address(&self, cpu: Cpu) -> usize {
        usize::from(u16::from_le_bytes([cpu.data(self.registers.eearl), cpu.data(self.registers.eearh)]))
    }

    fn write_address(&self, cpu: Cpu, register: u16, value: u8) {
        if self.writing_until.is_some() {
            return;
        }
        let [low, high] = (self.registers.size - 1).to_le_bytes();
        cpu.set_data(register, value & if register == self.registers.eearl { low } else { high });
    }

    fn write_control(&mut self, cpu: Cpu, value: u8) {
        let now = cpu.cycle();
        let mode =
            self.modes() & if self.writing_until.is_some() { cpu.data(self.registers.eecr) } else { value };
        let is_writable = self.writable_until.is_some_and(|until| now <= until);
        if self.writing_until.is_none() && is_writable && value & EEWE != 0 {
            self.writable_until = None;
            let (address, data) = (self.address(cpu), cpu.data(self.registers.eedr));
            let place = &mut self.contents[address];
            let micros;
            (*place, micros) = match (mode, self.registers.half_micros) {
                (ERASE_ONLY, Some(half)) => (0xff, half),
                (WRITE_ONLY, Some(half)) => (*place & data, half),
                _ => (data, self.registers.write_micros),
            };
            self.writing_until = Some(now + micros * MICRO);
            cpu.halt(WRITE_HALT);
        } else if value & (EEMWE | EEWE) == EEMWE {
            self.writable_until = self.writable_until.or(Some(now + MASTER_WRITE_CYCLES));
        }
        if self.writing_until.is_none() && value & EERE != 0 {
            cpu.set_data(self.registers.eedr, self.contents[self.address(cpu)]);
            cpu.halt(READ_HALT);
        }
        cpu.set_data(self.registers.eecr, value & EERIE | mode | self.state());
    }

    /// The bits of EECR that choose what a write does.
    fn modes(&self) -> u8 {
        if self.registers.half_micros.is_some() { EEPM } else { 0 }
    }

    /// The bits of EECR that the hardware sets and clears.
    fn state(&self) -> u8 {
        let writable = if self.writable_until.is_some() { EEMWE } else { 0 };
        let writing = if self.writing_until.is_some() { EEWE } else { 0 };
        writable | writing
    }
}

impl Device for Eeprom {
    fn write(&mut self, cpu: Cpu, address: u16, value: u8) {
        if address == self.registers.eecr {
            self.write_control(cpu, value);
            self.refresh(cpu);
        } else {
            self.write_address(cpu, address, value);
        }
    }

    fn due(&self) -> Option<u64> {
        let lapse = self.writable_until.map(|until| until + 1);
        [lapse, self.writing_until].into_iter().flatten().min()
    }

    fn expire(&mut self, cpu: Cpu, now: u64) {
        self.writable_until = self.writable_until.filter(|&until| until >= now);
        self.writing_until = self.writing_until.filter(|&until| until > now);
        let kept = cpu.data(self.registers.eecr) & (EERIE | self.modes());
        cpu.set_data(self.registers.eecr, kept | self.state());
        self.refresh(cpu);
    }
}
