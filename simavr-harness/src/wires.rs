//! The wires of the two-wire bus at an MCU's pins. A program reads and drives them without its interface to
//! free a bus that is stuck.

use crate::cpu::Cpu;
use crate::device::{Attached, Device};
use crate::part::Pin;

/// SCL and SDA of the ATmega128.
const CLOCK: Pin = Pin { port: 'D', bit: 0 };
const DATA: Pin = Pin { port: 'D', bit: 1 };

/// Counts the pulses that a program gives on SCL by its pin.
pub(crate) struct Wires {
    clock_is_high: bool,
    pulses: u32,
}

/// Pulls both wires up at the MCU, as the resistors do.
pub(crate) fn attach(cpu: Cpu) -> Attached<Wires> {
    cpu.drive_pin(CLOCK.port, CLOCK.bit, true);
    cpu.drive_pin(DATA.port, DATA.bit, true);
    let attached = Attached::new(cpu, Wires { clock_is_high: true, pulses: 0 }, &[], &[]);
    attached.watch_pin(cpu, CLOCK.port, CLOCK.bit);
    attached
}

impl Wires {
    /// Pulses since the last call.
    pub fn take_pulses(&mut self) -> u32 {
        std::mem::take(&mut self.pulses)
    }

    /// Shows the program the level of SDA.
    pub fn set_data(cpu: Cpu, level: bool) {
        cpu.drive_pin(DATA.port, DATA.bit, level);
    }
}

impl Device for Wires {
    fn write(&mut self, _cpu: Cpu, _address: u16, _value: u8) {
        // It has no register.
    }

    fn pin_changed(&mut self, cpu: Cpu, _bit: u8, level: bool) {
        let was_high = std::mem::replace(&mut self.clock_is_high, level);
        if level && !was_high {
            self.pulses += 1;
            cpu.call_attention(); // the bus may let SDA go
        }
    }
}
