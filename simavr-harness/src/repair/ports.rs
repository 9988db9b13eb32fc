//! Ports of which compare units drive pins (ATmega128 datasheet, "I/O Ports", "Alternate Port Functions").
//! The program reads and writes PORTx as ever; its pins follow the units, and once these let go, PORTx
//! again. simavr puts the levels of the units into PORTx, where a write to any pin of the port changes
//! them.

use std::collections::BTreeMap;

use crate::cpu::Cpu;
use crate::device::{Attached, Device, WrappedWrites};
use crate::part::{Port, TimerRegisters};

/// PORTx and PINx as the program reads them.
pub(crate) struct Reads(Port);

/// The ports of all compare units.
fn ports(timers: &[TimerRegisters]) -> impl Iterator<Item = Port> {
    let units = timers.iter().flat_map(|timer| timer.compare);
    units.map(|unit| (unit.port.name, unit.port)).collect::<BTreeMap<_, _>>().into_values()
}

/// Keeps what the program writes off the pins of the units.
pub(crate) fn install(cpu: Cpu, timers: &[TimerRegisters], wrapped: &mut WrappedWrites) {
    for port in ports(timers) {
        wrapped.replace(cpu, port.register(), move |cpu, written| cpu.write_port(port, written));
        wrapped.replace(cpu, port.direction(), move |cpu, written| {
            cpu.show_outputs(port);
            written
        });
    }
}

/// Has the program read what it has written to PORTx, and the levels of the pins.
pub(crate) fn attach(cpu: Cpu, timers: &[TimerRegisters]) -> Vec<Attached<Reads>> {
    ports(timers).map(|port| Attached::new(cpu, Reads(port), &[], &[port.register(), port.pins])).collect()
}

impl Device for Reads {
    fn write(&mut self, _cpu: Cpu, _address: u16, _value: u8) {
        // simavr handles the writes.
    }

    fn read(&mut self, cpu: Cpu, address: u16) -> u8 {
        if address == self.0.pins { cpu.read_pins(self.0) } else { cpu.read_port(self.0) }
    }
}
