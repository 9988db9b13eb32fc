//! ICR1 can be written only in a mode of Timer1 that counts up to it (chapter "16-bit Timer/Counter", "Input
//! Capture Register"). simavr takes every write.

use crate::cpu::Cpu;
use crate::device::{Attached, Device};
use crate::part::Timer1Registers;

/// Bits of TCCR1A and of TCCR1B. The modes with WGM13 set and WGM10 clear count up to ICR1.
const WGM10: u8 = 0x01;
const WGM13: u8 = 0x10;

pub(crate) struct Timer1 {
    registers: &'static Timer1Registers,
    /// The high byte on its way to ICR1.
    high: u8,
}

pub(crate) fn attach(cpu: Cpu, registers: &'static Timer1Registers) -> Attached<Timer1> {
    let &Timer1Registers { icrl, icrh, .. } = registers;
    Attached::new(cpu, Timer1 { registers, high: 0 }, &[icrl, icrh], &[])
}

impl Device for Timer1 {
    fn write(&mut self, cpu: Cpu, address: u16, value: u8) {
        let &Timer1Registers { icrl, icrh, tccra, tccrb } = self.registers;
        if address == icrh {
            self.high = value;
        } else if cpu.data(tccrb) & WGM13 != 0 && cpu.data(tccra) & WGM10 == 0 {
            cpu.set_data(icrl, value);
            cpu.set_data(icrh, self.high);
        }
    }
}
