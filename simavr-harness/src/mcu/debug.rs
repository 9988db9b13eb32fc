//! Stops an MCU between two instructions, for a debugger.

use std::ops::Range;

use instruction_set::Instruction::*;
use instruction_set::Step;

use super::{Mcu, SREG};
use crate::cpu::{CoreState, Registers};

/// Looks at an MCU before each of its instructions.
pub trait Debugger: Send {
    /// The MCU is about to execute an instruction, and waits for this call to return. Reading the MCU's state
    /// does not change the run.
    fn before_instruction(&mut self, mcu: &mut Mcu);
}

impl Mcu {
    /// Calls `debugger` before each instruction from now on.
    pub fn set_debugger(&mut self, debugger: Box<dyn Debugger>) {
        self.debugger = Some(debugger);
    }

    pub(super) fn show_debugger(&mut self) {
        if let Some(mut debugger) = self.debugger.take() {
            debugger.before_instruction(self);
            self.debugger = Some(debugger);
        }
    }

    pub fn registers(&self) -> Registers {
        let general = std::array::from_fn(|number| self.cpu.data(number as u16));
        let status = self.cpu.status_register();
        Registers { general, status, stack_pointer: self.stack_pointer(), pc: self.pc() }
    }

    /// Sets the registers, between two instructions.
    pub fn set_registers(&mut self, registers: &Registers) {
        let Registers { general, status, stack_pointer, pc } = registers;
        for (number, &value) in (0..).zip(general) {
            self.write(number, value);
        }
        let [low, high] = stack_pointer.to_le_bytes();
        self.write(SREG - 2, low);
        self.write(SREG - 1, high);
        self.write(SREG, *status);
        let state = self.cpu.core_state();
        self.cpu.set_core_state(CoreState { pc: *pc, ..state });
    }

    /// The addresses in the data space that the next instruction will read, without those of the general
    /// registers that it names.
    pub fn reads_next(&self) -> Range<u16> {
        let word = |at: usize| {
            let bytes = self.image.flash().get(2 * at..2 * at + 2);
            bytes.and_then(|bytes| bytes.first_chunk().copied()).map_or(u16::MAX, u16::from_le_bytes)
        };
        let at = self.pc() / 2;
        let instruction = instruction_set::decode(at, word(at as usize), word(at as usize + 1));
        let pointer = |register: u8| {
            let [low, high] = [register, register + 1].map(|number| self.cpu.data(number.into()));
            u16::from_le_bytes([low, high])
        };
        let from_stack = |bytes: u16| {
            let first = self.stack_pointer().wrapping_add(1);
            first..first.saturating_add(bytes)
        };
        let byte = |address: u16| address..address.saturating_add(1);
        match instruction {
            Ldd { pointer: by, displacement, .. } => byte(pointer(by).wrapping_add(displacement.into())),
            Lds { address, .. } => byte(address),
            LdStep { pointer: by, step: Step::On, .. } => byte(pointer(by)),
            LdStep { pointer: by, step: Step::Back, .. } => byte(pointer(by).wrapping_sub(1)),
            Pop { .. } => from_stack(1),
            Ret | Reti => from_stack(self.part().return_address),
            In { address, .. }
            | Sbis { address, .. }
            | Sbic { address, .. }
            | Sbi { address, .. }
            | Cbi { address, .. } => byte(address.into()),
            _ => 0..0,
        }
    }

    /// The data space: registers, I/O registers and SRAM.
    pub fn data(&self) -> Vec<u8> {
        let mut data = self.cpu.with_data(<[u8]>::to_vec);
        data[usize::from(SREG)] = self.cpu.status_register();
        data
    }
}
