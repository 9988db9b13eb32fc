//! Tables in program memory (ATmega128 datasheet, "ELPM/LPM – Load Program Memory").

use core::arch::asm;
use core::mem::{MaybeUninit, size_of};

/// A copy of element `index` of a table in the low 64 KB of flash, or `None` past its end. 10 cycles for a
/// byte; a longer element is copied by way of RAM, 10 cycles a byte and 30 more.
pub(crate) fn load<T: Copy>(table: &[T], index: usize) -> Option<T> {
    if index >= table.len() {
        return None;
    }
    let mut from = table.as_ptr().cast::<u8>().wrapping_add(index * size_of::<T>());
    let mut value = MaybeUninit::<T>::uninit();
    for offset in 0..size_of::<T>() {
        let byte: u8;
        // SAFETY: `index` is in range, so the address lies in element `index`, which the contract of
        // `Flash::new` places in program memory; `lpm` changes nothing but its destination register and Z.
        unsafe {
            asm!(
                "lpm {byte}, Z+", // 3: the byte at Z in the low 64 KB of flash
                byte = out(reg) byte,
                inout("Z") from,
                options(pure, readonly, nostack, preserves_flags),
            );
        }
        // SAFETY: `offset` is below the size of `value`.
        unsafe { value.as_mut_ptr().cast::<u8>().add(offset).write(byte) }
    }
    // SAFETY: every byte of `value` was just copied from a valid `T`, which is `Copy`.
    Some(unsafe { value.assume_init() })
}

/// A static of [`flash!`](crate::flash!), in the section that the start-up code does not copy to RAM.
///
/// # Safety
/// The address of what lies there is none in the data space: it may only be a [`Flash`](crate::flash::Flash).
#[doc(hidden)]
#[macro_export]
macro_rules! flash_static {
    (unsafe $($item:tt)*) => {
        #[unsafe(link_section = ".progmem.data")]
        $($item)*
    };
}
