//! The interrupt vectors of an instance.

use std::ptr::NonNull;

use simavr_ffi as ffi;

use super::Cpu;

/// An interrupt vector of one instance, under the invariant of [`Cpu`].
#[derive(Clone, Copy)]
pub(crate) struct Vector(NonNull<ffi::avr_int_vector_t>);

// SAFETY: by the invariant of `Cpu` all vectors belong to one `Mcu`, and so move with it.
unsafe impl Send for Vector {}

/// Bits of one register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RegisterBits {
    pub address: u16,
    pub mask: u8,
}

impl Cpu {
    /// All vectors that simavr knows, in no particular order.
    pub fn vectors(self) -> impl Iterator<Item = Vector> {
        // SAFETY: the table is part of the instance; its first `vector_count` entries are set.
        let (table, count) = unsafe {
            let interrupts = &raw const (*self.as_ptr()).interrupts;
            ((*interrupts).vector, (*interrupts).vector_count)
        };
        table.into_iter().take(usize::from(count)).filter_map(NonNull::new).map(Vector)
    }

    pub fn vector(self, number: u8) -> Option<Vector> {
        self.vectors().find(|vector| vector.number() == number)
    }

    /// Raises an interrupt: sets its flag, and makes it pending if it is enabled.
    pub fn raise(self, vector: Vector) {
        // SAFETY: both are alive; the vector belongs to this instance.
        unsafe { ffi::avr_raise_interrupt(self.as_ptr(), vector.0.as_ptr()) };
    }

    /// Makes a pending interrupt not pending. Its flag stays as it is.
    pub fn withdraw(self, vector: Vector) {
        vector.set_pending(false);
        self.forget_withdrawn();
    }

    /// Drops from simavr's queue the vectors that are no longer pending. simavr leaves them there,
    /// where they fill the queue and keep the core from sleeping.
    pub fn forget_withdrawn(self) {
        // SAFETY: the queue is part of the instance; its indices stay below its length, a power of
        // two, and the entries between them are vectors of this instance.
        unsafe {
            let avr = self.as_ptr();
            let queue = &raw mut (*avr).interrupts.pending;
            let length = (*queue).buffer.len() as u16;
            let (mut from, mut to) = ((*queue).read, (*queue).read);
            while from != (*queue).write {
                let entry = (*queue).buffer[usize::from(from)];
                if (*entry).pending() != 0 {
                    (*queue).buffer[usize::from(to)] = entry;
                    to = (to + 1) % length;
                }
                from = (from + 1) % length;
            }
            (*queue).write = to;
            if (*avr).interrupt_state > 0 && (*queue).read == to {
                (*avr).interrupt_state = 0;
            }
        }
    }

    /// Whether the last instruction enabled interrupts, so that the next one runs before any is accepted.
    pub fn enabled_just_now(self) -> bool {
        // SAFETY: the instance is alive by the type's invariant.
        unsafe { (*self.as_ptr()).interrupt_state < 0 }
    }

    /// Whether the next [`Cpu::serve_interrupts`] would accept an interrupt.
    pub fn interrupt_waits(self) -> bool {
        // SAFETY: the instance is alive by the type's invariant.
        unsafe { (*self.as_ptr()).interrupt_state > 0 }
    }

    /// Accepts the pending interrupt of the lowest number if the core is ready for it: pushes the
    /// return address and jumps to the vector. Returns that vector.
    pub fn serve_interrupts(self) -> Option<Vector> {
        let avr = self.as_ptr();
        // SAFETY: the instance is alive; `running` holds vectors of this instance. simavr's stack
        // of running handlers is emptied at once: a kernel that switches tasks in a handler does
        // not return from them in order.
        unsafe {
            if (*avr).interrupt_state == 0 {
                return None;
            }
            ffi::avr_service_interrupts(avr);
            if (*avr).interrupts.running_ptr == 0 {
                return None;
            }
            (*avr).interrupts.running_ptr = 0;
            NonNull::new((*avr).interrupts.running[0]).map(Vector)
        }
    }
}

impl Vector {
    pub fn number(self) -> u8 {
        // SAFETY: the vector lives in the instance, alive by the invariant of `Cpu`.
        unsafe { (*self.0.as_ptr()).vector }
    }

    pub fn enable_bit(self) -> RegisterBits {
        // SAFETY: the vector lives in the instance, alive by the invariant of `Cpu`.
        unsafe { (*self.0.as_ptr()).enable }.into()
    }

    pub fn flag_bit(self) -> RegisterBits {
        // SAFETY: the vector lives in the instance, alive by the invariant of `Cpu`.
        unsafe { (*self.0.as_ptr()).raised }.into()
    }

    pub fn is_pending(self) -> bool {
        // SAFETY: the vector lives in the instance, alive by the invariant of `Cpu`.
        unsafe { (*self.0.as_ptr()).pending() != 0 }
    }

    fn set_pending(self, pending: bool) {
        // SAFETY: the vector lives in the instance, alive by the invariant of `Cpu`.
        unsafe { (*self.0.as_ptr()).set_pending(pending.into()) }
    }
}

impl From<ffi::avr_regbit_t> for RegisterBits {
    fn from(bit: ffi::avr_regbit_t) -> Self {
        let address = bit.reg() as u16;
        let mask = if address == 0 { 0 } else { (bit.mask() as u8) << bit.bit() };
        Self { address, mask }
    }
}
