//! Constants that stay in program memory.
//!
//! The AVR has two address spaces, and compiled constants are copied to SRAM at start. A table of
//! rules or strings would eat the 4 KB; [`flash!`](crate::flash!) leaves it in the low 64 KB of
//! flash and reads it with `lpm` (ATmega128 datasheet, "ELPM/LPM – Load Program Memory").

use crate::arch;

/// A constant in program memory. Made by [`flash!`](crate::flash!), which places it there.
///
/// A reference to an array converts to a reference to a table of any length, `&Flash<[T]>`.
#[repr(transparent)]
pub struct Flash<T: ?Sized>(T);

impl<T> Flash<T> {
    /// Wraps `value`.
    ///
    /// # Safety
    /// On the AVR the result must be a `static` in the section `.progmem.data`, as
    /// [`flash!`](crate::flash!) makes it: reads go through `lpm`, not through the data bus.
    pub const unsafe fn new(value: T) -> Self {
        Flash(value)
    }
}

impl<T: Copy, const N: usize> Flash<[T; N]> {
    /// The number of elements.
    pub const fn len(&self) -> usize {
        N
    }

    /// Whether there are no elements.
    pub const fn is_empty(&self) -> bool {
        N == 0
    }

    /// A copy of element `index`, or `None` past the end. About 10 cycles for a byte; for a longer element 10
    /// a byte, and 30 more.
    pub fn get(&self, index: usize) -> Option<T> {
        arch::load(&self.0, index)
    }

    /// Copies of all elements, in order.
    pub fn iter(&self) -> impl Iterator<Item = T> + '_ {
        (0..N).filter_map(|index| self.get(index))
    }
}

impl<T: Copy> Flash<[T]> {
    /// The number of elements.
    pub const fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are no elements.
    pub const fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// A copy of element `index`, or `None` past the end.
    pub fn get(&self, index: usize) -> Option<T> {
        arch::load(&self.0, index)
    }

    /// Copies of all elements, in order.
    pub fn iter(&self) -> impl Iterator<Item = T> + '_ {
        (0..self.len()).filter_map(|index| self.get(index))
    }
}

/// Declares a `static` array that stays in program memory. Tables that do not fit into the low 64 KB do not
/// link.
///
/// ```
/// kernel::flash! {
///     /// Squares of the first numbers.
///     static SQUARES: [u8; 4] = [0, 1, 4, 9];
/// }
/// assert_eq!(SQUARES.get(3), Some(9));
/// assert_eq!(SQUARES.get(4), None);
///
/// let table: &kernel::flash::Flash<[u8]> = &SQUARES;
/// assert_eq!(table.iter().sum::<u8>(), 14);
/// ```
///
/// Only a [`Flash`] may lie there. The macro that places it wants `unsafe`:
///
/// ```compile_fail
/// kernel::flash_static! { // error: no rules expected `static`
///     static TABLE: [u8; 1] = [1];
/// }
/// ```
///
/// Unsafe code in the value needs an unsafe block of its own:
///
/// ```compile_fail,E0133
/// const unsafe fn promised() -> u8 { 1 }
/// kernel::flash! {
///     static TABLE: [u8; 1] = [promised()]; // error: call to unsafe function requires an unsafe block
/// }
/// ```
#[macro_export]
macro_rules! flash {
    ($($(#[$attribute:meta])* $visibility:vis static $name:ident: $type:ty = $value:expr;)*) => {$(
        // SAFETY: a `Flash`, which is read from there.
        $crate::flash_static! { unsafe
            $(#[$attribute])*
            $visibility static $name: $crate::flash::Flash<$type> = {
                let value: $type = $value; // outside of the unsafe block
                // SAFETY: `flash_static` places the value where `Flash` reads it.
                unsafe { $crate::flash::Flash::new(value) }
            };
        }
    )*};
}
