//! An MCU that is held up between two instructions.

use super::{Mcu, SREG};
use crate::cpu::{CoreState, Registers};

/// Looks at an MCU before each of its instructions.
pub trait Debugger: Send {
    /// The MCU is about to execute an instruction, and waits for this to return. What is only looked at does
    /// not change what happens.
    fn before_instruction(&mut self, mcu: &mut Mcu);
}

impl Mcu {
    /// Has somebody look on from now on.
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
        self.cpu.set_core_state(CoreState { pc: *pc, status: *status, ..state });
    }

    /// The data space: registers, I/O registers and SRAM.
    pub fn data(&self) -> Vec<u8> {
        let mut data = self.cpu.with_data(<[u8]>::to_vec);
        data[usize::from(SREG)] = self.cpu.status_register();
        data
    }
}
