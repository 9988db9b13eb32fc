//! The EEPROM: 4 KB that keep their content without power.
//!
//! A byte takes 8.5 ms to write. Meanwhile the task is blocked and the CPU is free; no call waits in a loop.
//! Alternatively, one task alone may write byte by byte, without the interrupt, and poll whether a byte is
//! written: [`Eeprom`].

use core::arch::asm;

use avr_device::atmega128a::EEPROM;
use embedded_storage::ReadStorage;
use kernel::{Context, Interrupt, Masked, Semaphore, Task};

use crate::WithTask;
use crate::deferred;
use crate::interrupts::Serves;

/// The size of the EEPROM, in bytes.
pub const SIZE: u16 = 4096;

/// Some of the requested bytes lie beyond [`SIZE`]. None was read or written.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct OutOfRange;

/// Holds one signal while no task uses the EEPROM.
static FREE: Semaphore = Semaphore::new(1);
static IS_READY: Semaphore = Semaphore::new(0);

fn registers() -> EEPROM {
    // SAFETY: the owner of `Eeprom` alone uses the registers. Once it is started, tasks use them while they
    // hold `FREE`'s signal; the interrupt uses only the bit that enables it, which a task sets before it
    // waits.
    unsafe { EEPROM::steal() }
}

/// The EEPROM, for one task that does not wait for it, or to be [started](Self::start) for others.
pub struct Eeprom(());

impl Eeprom {
    pub(crate) const fn new() -> Self {
        Eeprom(())
    }

    /// Whether no byte is being written. Only then may one be read or written. After a write, call it until
    /// it returns `true`: what interrupts hand over to tasks may wait for that.
    pub fn is_ready(&self, task: &mut Task) -> bool {
        let is_ready = registers().eecr().read().eewe().bit_is_clear();
        if is_ready {
            task.mask(deferred::renew);
        }
        is_ready
    }

    /// The byte at `address`, below [`SIZE`].
    pub fn read(&self, address: u16) -> u8 {
        read(address)
    }

    /// Begins to write a byte, which takes 8.5 ms. A write wears its place, which lasts for 100,000 writes.
    pub fn write(&mut self, task: &mut Task, address: u16, byte: u8) {
        write(task, address, byte);
    }

    /// Opens the EEPROM to several tasks.
    pub fn start(self, _: impl Serves<Eeprom>) -> Storage {
        Storage(())
    }
}

/// The EEPROM, for any number of tasks. One uses it at a time: each call takes the EEPROM for its whole
/// duration, and blocks until it has it.
///
/// A task that writes blocks while it has the EEPROM, which is why this is no `kernel::Mutex`: a task that
/// waits for it waits up to 8.5 ms for each byte, whatever its priority.
#[derive(Clone, Copy)]
pub struct Storage(());

impl Storage {
    /// Fills `buffer` with the bytes from `address` on. About 2 us a byte.
    ///
    /// # Errors
    /// [`OutOfRange`], with `buffer` unchanged.
    pub fn read(self, task: &mut Task, address: u16, buffer: &mut [u8]) -> Result<(), OutOfRange> {
        let addresses = addresses(address, buffer.len())?;
        take(task);
        for (address, byte) in addresses.zip(buffer) {
            *byte = read(address);
        }
        FREE.post(task);
        Ok(())
    }

    /// Writes `bytes` from `address` on, and returns when they are written: 8.5 ms for each. A byte that has
    /// the right value already is not written, which takes no time and wears nothing. Any other wears its
    /// place, which lasts for 100,000 writes.
    ///
    /// Other tasks see all of `bytes` or none. A reset during the write leaves the first ones written.
    ///
    /// # Errors
    /// [`OutOfRange`], with nothing written.
    pub fn write(self, task: &mut Task, address: u16, bytes: &[u8]) -> Result<(), OutOfRange> {
        let addresses = addresses(address, bytes.len())?;
        take(task);
        for (address, byte) in addresses.zip(bytes) {
            if read(address) != *byte {
                write(task, address, *byte);
                wait_until_ready(task);
            }
        }
        FREE.post(task);
        Ok(())
    }
}

impl Storage {
    /// This EEPROM as embedded-storage's [`ReadStorage`] and [`Storage`](embedded_storage::Storage).
    pub fn with<'a>(&'a mut self, task: &'a mut Task) -> WithTask<'a, Self> {
        WithTask::new(self, task)
    }
}

impl ReadStorage for WithTask<'_, Storage> {
    type Error = OutOfRange;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), OutOfRange> {
        let address = u16::try_from(offset).map_err(|_| OutOfRange)?;
        self.device.read(self.task, address, bytes)
    }

    fn capacity(&self) -> usize {
        SIZE.into()
    }
}

impl embedded_storage::Storage for WithTask<'_, Storage> {
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), OutOfRange> {
        let address = u16::try_from(offset).map_err(|_| OutOfRange)?;
        self.device.write(self.task, address, bytes)
    }
}

/// The addresses of `length` bytes from `address` on.
fn addresses(address: u16, length: usize) -> Result<core::ops::Range<u16>, OutOfRange> {
    let length = u16::try_from(length).map_err(|_| OutOfRange)?;
    match address.checked_add(length) {
        Some(end) if end <= SIZE => Ok(address..end),
        _ => Err(OutOfRange),
    }
}

/// Takes the EEPROM. A write from before a reset may still be under way.
fn take(task: &mut Task) {
    FREE.wait_by_call(task);
    wait_until_ready(task);
}

/// Blocks until no write is under way.
fn wait_until_ready(task: &mut Task) {
    if registers().eecr().read().eewe().bit_is_set() {
        task.mask(|_| registers().eecr().modify(|_, w| w.eerie().set_bit()));
        IS_READY.wait_by_call(task);
    }
    task.mask(deferred::renew);
}

/// Reads a byte. No write may be under way.
fn read(address: u16) -> u8 {
    set_address(address);
    // SAFETY: one bit of EECR, and the EEPROM touches no memory. By OUT, because EERE, if set by ST or STS as
    // the compiler might do, triggers an interrupt that was not enabled (datasheet, "Errata").
    unsafe {
        asm!(
            "out 0x1c, {read}", // 1: EERE; the CPU halts for 4 more
            read = in(reg) 1u8,
            options(nostack, preserves_flags)
        );
    }
    registers().eedr().read().bits()
}

/// Begins to write a byte. No write may be under way.
fn write(task: &mut Task, address: u16, byte: u8) {
    set_address(address);
    // SAFETY: the EEPROM touches no memory, whatever its registers hold.
    registers().eedr().write(|w| unsafe { w.bits(byte) });
    // The software interrupt occurs in the window, if it is due.
    while !task.mask(begin_write) {
        task.window();
    }
}

/// Begins to write, unless the software interrupt is due. Returns whether it did.
fn begin_write(masked: &Masked) -> bool {
    if !deferred::is_free(masked) {
        return false;
    }
    // SAFETY: two bits of EECR, and the EEPROM touches no memory. EEWE counts only within four cycles of
    // EEMWE, so interrupts are masked.
    unsafe {
        asm!(
            "sbi 0x1c, 2", // 2 cycles: EEMWE
            "sbi 0x1c, 1", // 2 cycles: EEWE; the CPU halts for 2 more
            options(nomem, nostack, preserves_flags)
        );
    }
    true
}

fn set_address(address: u16) {
    // SAFETY: the EEPROM touches no memory, whatever its registers hold.
    registers().eear().write(|w| unsafe { w.bits(address) });
}

/// The interrupt "EEPROM Ready". It stays pending until it is disabled.
#[doc(hidden)]
#[inline(always)]
pub fn ready(interrupt: &mut Interrupt) {
    registers().eecr().reset();
    IS_READY.post(interrupt);
}
