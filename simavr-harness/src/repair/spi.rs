//! The serial peripheral interface of the ATmega128 (chapter "Serial Peripheral Interface") as a master, in
//! place of simavr's, in which a program reads back what it has sent. Here it reads the level of MISO.
//!
//! Where the outside drives SS low while that is an input, the master becomes a slave.
//!
//! Simplified: nobody but the program is at the bus, so MISO keeps its level during a byte, and a slave is
//! never sent anything; SS as an input that floats is taken to be high; SCK and MOSI keep their levels.

use crate::cpu::{Cpu, Vector};
use crate::device::{Attached, Device, make_plain};
use crate::part::Pin;
use crate::repair::interrupt;

const SPCR: u16 = 0x2d;
const SPSR: u16 = 0x2e;
const SPDR: u16 = 0x2f;
const VECTOR: u8 = 17;
const MISO: Pin = Pin { port: 'B', bit: 3 };
const SS: Pin = Pin { port: 'B', bit: 0 };
const DDRB: u16 = 0x37;

// SPCR
const SPE: u8 = 0x40;
const MSTR: u8 = 0x10;
const SPR: u8 = 0x03;
// SPSR
const SPIF: u8 = 0x80;
const WCOL: u8 = 0x40;
const SPI2X: u8 = 0x01;

pub(crate) struct Spi {
    complete: Vector,
    /// The end of the byte under way.
    shifts_until: Option<u64>,
    received: u8,
    /// The program has read these flags. Its next access to SPDR clears them.
    seen: u8,
}

/// Replaces simavr's interface by the harness's. `None`: the part has no such vector.
pub(crate) fn attach(cpu: Cpu) -> Option<Attached<Spi>> {
    let spi = Spi { complete: cpu.vector(VECTOR)?, shifts_until: None, received: 0, seen: 0 };
    make_plain(cpu, &[SPCR, SPSR, SPDR]);
    let attached = Attached::new(cpu, spi, &[SPCR, SPSR, SPDR], &[SPSR, SPDR]);
    attached.watch_pin(cpu, SS.port, SS.bit);
    Some(attached)
}

impl Spi {
    /// Sets the device to its state after a reset.
    pub fn reset(&mut self, cpu: Cpu) {
        (self.shifts_until, self.received, self.seen) = (None, 0, 0);
        interrupt::refresh(cpu, self.complete);
    }

    fn byte_cycles(cpu: Cpu) -> u64 {
        let clock = [4, 16, 64, 128][usize::from(cpu.data(SPCR) & SPR)];
        8 * if cpu.data(SPSR) & SPI2X != 0 { clock / 2 } else { clock }
    }

    /// Another master selects this one (section "SS Pin Functionality"), which becomes a slave.
    fn follow_select(&mut self, cpu: Cpu, is_high: bool) {
        let is_master = cpu.data(SPCR) & (SPE | MSTR) == SPE | MSTR;
        let is_input = cpu.data(DDRB) & 1 << SS.bit == 0;
        if is_master && is_input && !is_high && !cpu.is_floating(SS) {
            cpu.set_bits(SPCR, MSTR, false);
            self.shifts_until = None;
            cpu.raise(self.complete);
        }
    }

    /// An access to SPDR clears the flags that the program has read.
    fn clear_seen(&mut self, cpu: Cpu) {
        cpu.set_bits(SPSR, std::mem::take(&mut self.seen), false);
        interrupt::refresh(cpu, self.complete);
    }
}

impl Device for Spi {
    fn write(&mut self, cpu: Cpu, address: u16, value: u8) {
        match address {
            SPCR => {
                cpu.set_data(SPCR, value);
                if value & SPE == 0 {
                    self.shifts_until = None;
                }
                interrupt::refresh(cpu, self.complete);
                self.follow_select(cpu, cpu.is_high(SS));
            }
            SPSR => cpu.set_bits(SPSR, SPI2X, value & SPI2X != 0),
            _ => {
                self.clear_seen(cpu);
                if self.shifts_until.is_some() {
                    cpu.set_bits(SPSR, WCOL, true);
                } else if cpu.data(SPCR) & (SPE | MSTR) == SPE | MSTR {
                    self.shifts_until = Some(cpu.cycle() + Self::byte_cycles(cpu));
                }
            }
        }
    }

    fn read(&mut self, cpu: Cpu, address: u16) -> u8 {
        if address == SPDR {
            self.clear_seen(cpu);
            return self.received;
        }
        let status = cpu.data(SPSR);
        self.seen = status & (SPIF | WCOL);
        status
    }

    fn due(&self) -> Option<u64> {
        self.shifts_until
    }

    fn expire(&mut self, cpu: Cpu, _now: u64) {
        self.shifts_until = None;
        let is_high = cpu.is_high(MISO);
        self.received = if is_high { 0xff } else { 0 };
        cpu.raise(self.complete);
    }

    fn pin_changed(&mut self, cpu: Cpu, _bit: u8, is_high: bool) {
        self.follow_select(cpu, is_high);
    }
}
