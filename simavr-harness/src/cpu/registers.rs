//! The interface that an interpreter other than simavr's needs: the core's state, memory as cells, and the
//! I/O registers with their handlers.

use std::cell::Cell;

use serde::{Deserialize, Serialize};
use simavr_ffi as ffi;

use super::Cpu;

/// simavr's request for the value that a program reads in flash; fuses may be read there instead.
const READ_FLASH: u32 = u32::from_be_bytes(*b"flpm");

/// First data address of the I/O registers.
pub(crate) const IO_START: u16 = 0x20;

/// The registers of the core.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Registers {
    pub general: [u8; 32],
    /// SREG.
    pub status: u8,
    pub stack_pointer: u16,
    /// Address of the next instruction, in bytes.
    pub pc: u32,
}

/// The state of the core at an instruction boundary.
#[derive(Clone, Copy)]
pub(crate) struct CoreState {
    /// Address of the next instruction, in bytes.
    pub pc: u32,
    pub cycle: u64,
    /// The run ends at the first instruction boundary at or after this cycle.
    pub stop: u64,
    /// SREG.
    pub status: u8,
}

/// How an I/O register is read or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    /// As memory.
    Plain,
    /// By its handler.
    Handled,
    /// Only by simavr's own interpreter.
    Special,
}

impl Cpu {
    pub fn core_state(self) -> CoreState {
        let (pc, cycle, status) = (self.pc(), self.cycle(), self.status_register());
        // SAFETY: the instance is alive by the type's invariant.
        let left = unsafe { (*self.as_ptr()).run_cycle_count };
        CoreState { pc, cycle, stop: cycle + left, status }
    }

    pub fn set_core_state(self, state: CoreState) {
        let avr = self.as_ptr();
        // SAFETY: the instance is alive by the type's invariant.
        unsafe {
            (*avr).pc = state.pc;
            (*avr).cycle = state.cycle;
            (*avr).run_cycle_count = state.stop.saturating_sub(state.cycle);
            (*avr).sreg = std::array::from_fn(|index| state.status >> index & 1);
        }
    }

    /// The cycles left of the run after a call of a handler, and the cycle at which the run ends.
    pub fn run_left(self) -> (i64, u64) {
        let CoreState { cycle, stop, .. } = self.core_state();
        if self.must_pause() { (0, cycle) } else { (stop.wrapping_sub(cycle) as i64, stop) }
    }

    /// Whether the core may execute one instruction at most before the harness has to look at it: the core
    /// sleeps or has stopped, an interrupt is pending, or the last instruction enabled interrupts.
    pub fn must_pause(self) -> bool {
        // SAFETY: the instance is alive by the type's invariant.
        unsafe { (*self.as_ptr()).state as u32 != ffi::cpu_Running || (*self.as_ptr()).interrupt_state != 0 }
    }

    /// Notes that an instruction has set the I flag: one more instruction runs before an interrupt is
    /// accepted.
    pub fn enable_interrupts(self) {
        // SAFETY: the instance is alive by the type's invariant.
        unsafe { (*self.as_ptr()).interrupt_state = -1 }
    }

    /// Continues a run that has ended at `cycle` only because interrupts were enabled, if no interrupt is
    /// pending and no timer is due. Returns the cycle at which the run then ends.
    pub fn go_on(self, cycle: u64) -> Option<u64> {
        if !self.enabled_just_now() {
            return None;
        }
        // SAFETY: the instance and its `control` are alive by the type's invariant.
        unsafe {
            let avr = self.as_ptr();
            let stop = (*self.control()).deadline.min(self.next_timer().unwrap_or(u64::MAX));
            let waiting = &raw const (*avr).interrupts.pending;
            if (*waiting).read != (*waiting).write || cycle >= stop {
                return None;
            }
            (*avr).interrupt_state = 0;
            Some(stop)
        }
    }

    /// Calls `visit` on the whole data space. Handlers may write to it meanwhile.
    pub fn with_cells<R>(self, visit: impl FnOnce(&[Cell<u8>]) -> R) -> R {
        // SAFETY: simavr allocates `ramend + 1` bytes, which stay where they are until the instance is freed.
        // Cells may be written by others while they are lent.
        visit(unsafe { std::slice::from_raw_parts((*self.as_ptr()).data.cast(), self.data_size()) })
    }

    /// Bytes of a return address.
    pub fn return_address_size(self) -> u8 {
        // SAFETY: the instance is alive by the type's invariant.
        unsafe { (*self.as_ptr()).address_size }
    }

    /// How the I/O register at `address` is read.
    pub fn read_access(self, address: u16) -> Access {
        match self.io_register(address) {
            None => Access::Special,
            Some(register) if register.r.c.is_some() => Access::Handled,
            Some(_) => Access::Plain,
        }
    }

    /// How the I/O register at `address` is written.
    pub fn write_access(self, address: u16) -> Access {
        match self.io_register(address) {
            Some(register) if register.w.c.is_some() => Access::Handled,
            Some(register) if register.irq.is_null() => Access::Plain,
            _ => Access::Special,
        }
    }

    /// Whether simavr handles writes to single bits of the I/O register at `address`.
    pub fn has_bit_handler(self, address: u16) -> bool {
        // SAFETY: the instance is alive by the type's invariant, and the reference ends here.
        let handlers = unsafe { &(*self.as_ptr()).bit_io };
        handlers.get(usize::from(address - IO_START)).is_some_and(|handler| handler.c.is_some())
    }

    /// Reads an I/O register by its handler.
    pub fn read_handled(self, address: u16) -> u8 {
        let reader = self.io_register(address).map(|register| register.r);
        let Some((handler, parameter)) = reader.and_then(|reader| Some((reader.c?, reader.param))) else {
            return self.data(address);
        };
        // SAFETY: the handler gets its own parameter, and no reference into the instance exists across the
        // call.
        let value = unsafe { handler(self.as_ptr(), address, parameter) };
        self.set_data(address, value);
        value
    }

    /// Writes an I/O register by its handler.
    pub fn write_handled(self, address: u16, value: u8) {
        let writer = self.io_register(address).map(|register| register.w);
        if let Some((handler, parameter)) = writer.and_then(|writer| Some((writer.c?, writer.param))) {
            // SAFETY: the handler gets its own parameter, and no reference into the instance exists across
            // the call.
            unsafe { handler(self.as_ptr(), address, value, parameter) }
        }
    }

    /// The byte of the flash that an instruction reads at `address`. The address wraps at the end of the
    /// flash, because its upper bits are not decoded.
    pub fn read_flash(self, address: u16) -> u8 {
        let address = usize::from(address) % self.flash_size();
        // SAFETY: simavr allocates more than `flash_size` bytes, changes `value` during the call only, and no
        // reference into the instance exists across it.
        unsafe {
            let mut value = *(*self.as_ptr()).flash.add(address);
            ffi::avr_ioctl(self.as_ptr(), READ_FLASH, (&raw mut value).cast());
            value
        }
    }

    /// The entry of an I/O register in simavr's table; `None` where it has none.
    fn io_register<'a>(self, address: u16) -> Option<&'a ffi::avr_t__bindgen_ty_3> {
        // SAFETY: the instance is alive by the type's invariant; the reference is used in this file only, and
        // no longer than until a handler is called.
        let registers = unsafe { &(*self.as_ptr()).io };
        registers.get(usize::from(address - IO_START))
    }
}
