//! The AVR architecture as gdb knows it.

use gdbstub::arch::Arch;
use simavr_harness::Registers;

/// gdb has one address space: flash begins at 0, the data space here.
pub const DATA: u32 = 0x80_0000;

pub enum Avr {}

/// The registers in gdb's order: r0 to r31, SREG, SP in two bytes, PC in four.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Core(pub Registers);

impl Arch for Avr {
    type Usize = u32;
    type Registers = Core;
    type BreakpointKind = usize;
    type RegId = ();
}

impl gdbstub::arch::Registers for Core {
    type ProgramCounter = u32;

    fn pc(&self) -> u32 {
        self.0.pc
    }

    fn gdb_serialize(&self, mut write_byte: impl FnMut(Option<u8>)) {
        let Registers { general, status, stack_pointer, pc } = &self.0;
        let bytes = general.iter().copied().chain([*status]).chain(stack_pointer.to_le_bytes());
        bytes.chain(pc.to_le_bytes()).for_each(|byte| write_byte(Some(byte)));
    }

    fn gdb_deserialize(&mut self, bytes: &[u8]) -> Result<(), ()> {
        let (general, rest) = bytes.split_first_chunk().ok_or(())?;
        let &[status, low, high, ref pc @ ..] = rest else { return Err(()) };
        let pc = u32::from_le_bytes(pc.try_into().map_err(|_| ())?);
        self.0 = Registers { general: *general, status, stack_pointer: u16::from_le_bytes([low, high]), pc };
        Ok(())
    }
}
