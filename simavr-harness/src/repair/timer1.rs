//! ICR1 can be written only in a mode of Timer1 that counts up to it (chapter "16-bit Timer/Counter", "Input
//! Capture Register"). simavr takes every write.
//!
//! The high byte of a 16-bit register waits in the timer for the low byte (section "Accessing 16-bit
//! Registers"). Where the [body](crate::body_pins) follows the compare registers in simavr's place, they are
//! kept that way: otherwise the body would follow a value of which one byte is new and the other is old.
//!
//! OCF1C lies in ETIFR, beside Timer3's flags. simavr tells writes there to Timer3 alone.

use crate::cpu::Cpu;
use crate::device::{Attached, Device, WrappedWrites, make_plain};
use crate::part::Timer1Registers;
use crate::repair::interrupt;

/// Bits of TCCR1A and of TCCR1B. The modes with WGM13 set and WGM10 clear count up to ICR1.
const WGM10: u8 = 0x01;
const WGM13: u8 = 0x10;

pub(crate) struct Timer1 {
    registers: &'static Timer1Registers,
    /// The high byte on its way to a 16-bit register.
    high: u8,
}

pub(crate) fn attach(cpu: Cpu, registers: &'static Timer1Registers) -> Attached<Timer1> {
    let &Timer1Registers { icrl, icrh, .. } = registers;
    Attached::new(cpu, Timer1 { registers, high: 0 }, &[icrl, icrh], &[])
}

/// Makes a one written to OCF1C clear it.
pub(crate) fn install(cpu: Cpu, registers: &Timer1Registers, wrapped: &mut WrappedWrites) {
    let Some(vector) = cpu.vector(registers.compare_c) else { return };
    let flag = vector.flag_bit();
    wrapped.wrap(cpu, flag.address, move |cpu, etifr, _, written| {
        cpu.set_bits(etifr, flag.mask & written, false);
        interrupt::refresh(cpu, vector);
    });
}

/// Makes the compare registers the harness's, with no effect in simavr.
pub(crate) fn keep_compare_registers(cpu: Cpu, timer: &Attached<Timer1>) {
    for low in timer.get().registers.compare {
        make_plain(cpu, &[low, low + 1]);
        timer.take_writes(cpu, &[low, low + 1]);
    }
}

impl Device for Timer1 {
    fn write(&mut self, cpu: Cpu, address: u16, value: u8) {
        let &Timer1Registers { icrl, icrh, tccra, tccrb, compare, .. } = self.registers;
        let counts_to_icr = cpu.data(tccrb) & WGM13 != 0 && cpu.data(tccra) & WGM10 == 0;
        if address == icrh || compare.contains(&(address - 1)) {
            self.high = value;
        } else if address != icrl || counts_to_icr {
            cpu.set_data(address, value);
            cpu.set_data(address + 1, self.high);
        }
    }
}
