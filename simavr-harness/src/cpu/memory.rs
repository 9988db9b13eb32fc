//! SRAM, registers and flash of an instance.

use super::Cpu;

/// Bytes of the opcode that simavr keeps after the end of the flash.
const OVERFLOW_OPCODE: usize = 2;

impl Cpu {
    /// Size of the data space (registers, I/O, SRAM) in bytes.
    pub fn data_size(self) -> usize {
        // SAFETY: the instance is alive by the type's invariant.
        unsafe { usize::from((*self.as_ptr()).ramend) + 1 }
    }

    /// First address of SRAM, or of the memory that simavr has in place of registers before it.
    pub fn ram_start(self) -> u16 {
        // SAFETY: the instance is alive by the type's invariant.
        unsafe { (*self.as_ptr()).ioend + 1 }
    }

    /// Size of the flash in bytes.
    pub fn flash_size(self) -> usize {
        // SAFETY: the instance is alive by the type's invariant.
        unsafe { (*self.as_ptr()).flashend as usize + 1 }
    }

    /// The address of RAMPZ, if the part has it.
    pub fn rampz(self) -> Option<u16> {
        // SAFETY: the instance is alive by the type's invariant.
        let address = unsafe { (*self.as_ptr()).rampz };
        (address != 0).then_some(address)
    }

    /// Calls `visit` on the whole data space.
    pub fn with_data<R>(self, visit: impl FnOnce(&[u8]) -> R) -> R {
        // SAFETY: simavr allocates `ramend + 1` bytes; no simavr code runs inside `visit`, which
        // is given nothing else.
        visit(unsafe { std::slice::from_raw_parts((*self.as_ptr()).data, self.data_size()) })
    }

    /// Calls `visit` on the whole data space, writable. No register's side effect takes place.
    pub fn with_data_mut<R>(self, visit: impl FnOnce(&mut [u8]) -> R) -> R {
        // SAFETY: simavr allocates `ramend + 1` bytes; no simavr code runs inside `visit`, which is given
        // nothing else.
        visit(unsafe { std::slice::from_raw_parts_mut((*self.as_ptr()).data, self.data_size()) })
    }

    /// The stored value at `address`, without the side effects of a read by the program.
    pub fn data(self, address: u16) -> u8 {
        self.with_data(|data| data[usize::from(address)])
    }

    /// Stores `value` at `address`, without the side effects of a write by the program.
    pub fn set_data(self, address: u16, value: u8) {
        self.with_data_mut(|data| data[usize::from(address)] = value);
    }

    /// Sets the bits of `mask` at `address` to `on`.
    pub fn set_bits(self, address: u16, mask: u8, on: bool) {
        let value = self.data(address) & !mask;
        self.set_data(address, if on { value | mask } else { value });
    }

    /// Writes the flash from its start; bytes beyond its end are dropped.
    pub fn load_flash(self, code: &[u8]) {
        let length = code.len().min(self.flash_size());
        // SAFETY: simavr allocates `flashend + 4` bytes, and `length` is within `flashend + 1`.
        unsafe {
            std::ptr::copy_nonoverlapping(code.as_ptr(), (*self.as_ptr()).flash, length);
            (*self.as_ptr()).codeend = length as u32;
        }
    }

    /// Calls `visit` on the flash as simavr allocates it, with the opcode after its end by which simavr
    /// detects that end.
    pub fn with_flash<R>(self, visit: impl FnOnce(&[u8]) -> R) -> R {
        let length = self.flash_size() + OVERFLOW_OPCODE;
        // SAFETY: simavr allocates more bytes and gives these a value; no simavr code runs inside `visit`,
        // which is given nothing else.
        visit(unsafe { std::slice::from_raw_parts((*self.as_ptr()).flash, length) })
    }
}
