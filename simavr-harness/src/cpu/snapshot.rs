//! Saves the state of an instance and restores it.

use std::collections::BTreeMap;
use std::mem::MaybeUninit;

use super::{Cpu, Driven, Outputs};

// The GNU C library's.
unsafe extern "C" {
    /// The size of a block that `malloc` allocated. simavr does not export the size of a part's structure.
    fn malloc_usable_size(allocated: *mut std::ffi::c_void) -> usize;
}

/// All of simavr's memory that a program can change, except flash and EEPROM.
pub(crate) struct Snapshot {
    number: u64,
    /// The core with its timers and pending interrupts, and the peripherals behind it.
    structure: Box<[MaybeUninit<u8>]>,
    data: Box<[u8]>,
    /// Value and flags of each IRQ, which simavr allocates separately.
    irqs: Box<[(u32, u8)]>,
    fault: Option<String>,
    driven: BTreeMap<char, Driven>,
    outputs: BTreeMap<char, Outputs>,
}

impl Cpu {
    pub fn snapshot(self) -> Snapshot {
        // SAFETY: simavr allocates a part's structure, which begins with the core, in one piece.
        let structure = unsafe {
            let size = malloc_usable_size(self.as_ptr().cast());
            std::slice::from_raw_parts(self.as_ptr().cast::<MaybeUninit<u8>>(), size).into()
        };
        // SAFETY: the IRQs in the pool are live, and this one is only read.
        let irqs = self.irqs().map(|irq| unsafe { ((*irq).value, (*irq).flags) }).collect();
        // SAFETY: `control` lives as long as the instance, and the reference ends here.
        let control = unsafe { &*self.control() };
        let (driven, outputs) = (control.driven.clone(), control.outputs.clone());
        let (number, fault) = (control.number, control.fault.clone());
        Snapshot { number, structure, data: self.with_data(|data| data.into()), irqs, fault, driven, outputs }
    }

    /// # Panics
    /// When the snapshot is another instance's.
    pub fn restore(self, snapshot: Snapshot) {
        // SAFETY: `control` lives as long as the instance.
        let control = unsafe { &mut *self.control() };
        assert_eq!(control.number, snapshot.number, "a snapshot is of one instance");
        (control.fault, control.driven, control.outputs) =
            (snapshot.fault, snapshot.driven, snapshot.outputs);
        // SAFETY: the bytes were copied from this structure, so it has that size. Pointers among them are
        // valid: nothing that they point to is freed before the instance is.
        unsafe {
            let size = snapshot.structure.len();
            snapshot.structure.as_ptr().copy_to_nonoverlapping(self.as_ptr().cast(), size);
        }
        self.with_data_mut(|data| data.copy_from_slice(&snapshot.data));
        for (irq, &(value, flags)) in self.irqs().zip(&snapshot.irqs) {
            // SAFETY: the IRQs in the pool are live, and no reference to this one exists.
            unsafe { ((*irq).value, (*irq).flags) = (value, flags) };
        }
    }

    /// The instance's IRQs, always in the same order.
    fn irqs(self) -> impl Iterator<Item = *mut simavr_ffi::avr_irq_t> {
        // SAFETY: the pool is part of the instance; its table has `count` entries, null where an IRQ was
        // freed.
        let all = unsafe {
            let pool = &raw const (*self.as_ptr()).irq_pool;
            match (*pool).count as usize {
                0 => &[][..],
                count => std::slice::from_raw_parts((*pool).irq, count),
            }
        };
        all.iter().copied().filter(|irq| !irq.is_null())
    }
}
