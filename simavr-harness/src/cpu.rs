//! A thin layer over one simavr instance. Every dereference of simavr's structures is in this file, in those
//! of its folder, in `device`, or in `repair/watchdog`.
//!
//! A [`Cpu`] is a handle, copied freely between the harness and the callbacks that simavr makes into
//! it. No Rust reference into simavr's memory outlives the method that makes it, so a callback may
//! use its own handle during a [`run`](crate::execution::run).

use std::collections::BTreeMap;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::ptr::NonNull;
use std::sync::Once;
use std::sync::atomic::{AtomicU64, Ordering};

use simavr_ffi as ffi;

mod memory;
mod pins;
mod registers;
mod running;
mod snapshot;
mod vectors;

pub(crate) use pins::LEVEL;
pub use registers::Registers;
pub(crate) use registers::{Access, CoreState, IO_START};
pub(crate) use running::News;
pub(crate) use vectors::{RegisterBits, Vector};

// Missing from simavr-ffi's bindings.
unsafe extern "C" {
    /// The C library's, for what simavr allocated.
    fn free(allocated: *mut c_void);
}

/// Index of the I flag in SREG.
const INTERRUPT_FLAG: usize = 7;

const SPL: u16 = 0x5d;
const SPH: u16 = 0x5e;

/// Handle of one simavr instance.
///
/// Invariant: the instance lives as long as the `Mcu` that created it, and nothing that lives longer
/// keeps a handle. Within the crate this holds by construction: the `Mcu` keeps the handles and lends
/// them to its devices during a call.
#[derive(Clone, Copy)]
pub(crate) struct Cpu(NonNull<ffi::avr_t>);

// SAFETY: simavr keeps no state outside an instance but its logger, which is set once. By the type's
// invariant all handles belong to one `Mcu`, and so move with it.
unsafe impl Send for Cpu {}

/// The core's state, as simavr has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Core {
    Running,
    Sleeping,
    Stopped,
}

/// Why an MCU starts over (chapter "Reset Sources"). The watchdog resets by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// Power was off: SRAM and registers hold chance values.
    PowerOn,
    External,
    BrownOut,
}

/// The part of the harness that callbacks reach from simavr's structure (`avr_t::custom.data`).
#[derive(Default)]
struct Control {
    /// Unique among all instances.
    number: u64,
    /// Cycle at which the [`run`](crate::execution::run) under way has to return.
    deadline: u64,
    /// Set by a device that needs the harness before the deadline.
    attention: bool,
    /// The pending flags, by the numbers of [`News`].
    news: [bool; 2],
    /// The first error that simavr reported.
    fault: Option<String>,
    /// The flash is not simavr's own.
    shares_flash: bool,
    /// Pins that the outside drives, by port.
    driven: BTreeMap<char, Driven>,
    /// Pins that compare units drive, by port.
    outputs: BTreeMap<char, Outputs>,
}

/// The pins of a port that the outside drives, and their levels.
#[derive(Clone, Copy, Default)]
struct Driven {
    mask: u8,
    levels: u8,
}

/// The pins of a port that compare units drive, their levels, and PORTx as the program has it.
#[derive(Clone, Copy, Default)]
struct Outputs {
    mask: u8,
    levels: u8,
    latch: u8,
}

impl Cpu {
    /// Creates and initialises an instance; `None` if simavr does not know the part.
    pub fn create(part: &str, frequency_hz: u32) -> Option<Self> {
        static LOGGER: Once = Once::new();
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        // SAFETY: the logger is set once, before any instance exists, to a function that stays.
        LOGGER.call_once(|| unsafe { ffi::avr_global_logger_set(Some(log)) });
        let name = CString::new(part).ok()?;
        // SAFETY: `name` is a C string; simavr returns null or a new instance.
        let avr = NonNull::new(unsafe { ffi::avr_make_mcu_by_name(name.as_ptr()) })?;
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let control = Box::new(Control { number, ..Control::default() });
        // SAFETY: `avr` is a new instance, and there is no other pointer to it.
        unsafe {
            let instance = avr.as_ptr();
            (*instance).custom.data = Box::into_raw(control).cast();
            ffi::avr_init(instance);
            // simavr's table of registers is shorter than the space for them on a part with many, and writes
            // do not check its end. What lies beyond, no register of these parts, is memory like SRAM.
            let registers_end = IO_START + (*instance).io.len() as u16;
            (*instance).ioend = (*instance).ioend.min(registers_end - 1);
            (*instance).frequency = frequency_hz;
            (*instance).vcc = 5000;
            (*instance).avcc = 5000;
            (*instance).aref = 5000;
        }
        Some(Self(avr))
    }

    /// Frees the instance.
    ///
    /// # Safety
    /// No handle to this instance may be used afterwards.
    pub unsafe fn destroy(self) {
        let avr = self.0.as_ptr();
        // SAFETY: the instance is alive by the type's invariant; `control` came from a Box in
        // `create`, and the instance from malloc in simavr's `avr_core_allocate`.
        unsafe {
            if (*self.control()).shares_flash {
                (*avr).flash = std::ptr::null_mut();
            }
            ffi::avr_terminate(avr);
            drop(Box::from_raw((*avr).custom.data.cast::<Control>()));
            free(avr.cast());
        }
    }

    /// # Safety
    /// `avr` points to a live instance made by [`Cpu::create`].
    pub unsafe fn from_raw(avr: *mut ffi::avr_t) -> Self {
        // SAFETY: the caller passes simavr's own pointer, which is not null.
        Self(unsafe { NonNull::new_unchecked(avr) })
    }

    pub fn as_ptr(self) -> *mut ffi::avr_t {
        self.0.as_ptr()
    }

    fn control(self) -> *mut Control {
        // SAFETY: the instance is alive by the type's invariant.
        unsafe { (*self.as_ptr()).custom.data.cast() }
    }

    // --- Clock and core -------------------------------------------------------------------------

    /// Cycles since power-up.
    pub fn cycle(self) -> u64 {
        // SAFETY: the instance is alive by the type's invariant.
        unsafe { (*self.as_ptr()).cycle }
    }

    pub fn set_cycle(self, cycle: u64) {
        // SAFETY: the instance is alive by the type's invariant.
        unsafe { (*self.as_ptr()).cycle = cycle }
    }

    /// Halts the core for `cycles` during the instruction in progress, inside of a
    /// [`run`](crate::execution::run).
    pub fn halt(self, cycles: u64) {
        let avr = self.as_ptr();
        // SAFETY: the instance is alive by the type's invariant.
        unsafe {
            (*avr).cycle += cycles;
            // Without this, the run would pass the next timer by as many cycles.
            (*avr).run_cycle_count = (*avr).run_cycle_count.saturating_sub(cycles);
        }
        self.keep_deadline();
    }

    /// Address of the next instruction, in bytes.
    pub fn pc(self) -> u32 {
        // SAFETY: the instance is alive by the type's invariant.
        unsafe { (*self.as_ptr()).pc }
    }

    pub fn stack_pointer(self) -> u16 {
        u16::from_le_bytes([self.data(SPL), self.data(SPH)])
    }

    pub fn interrupts_enabled(self) -> bool {
        // SAFETY: the instance is alive by the type's invariant.
        unsafe { (*self.as_ptr()).sreg[INTERRUPT_FLAG] != 0 }
    }

    /// The status register. simavr keeps its bits apart and joins them only when they are read.
    pub fn status_register(self) -> u8 {
        // SAFETY: the instance is alive by the type's invariant.
        let bits = unsafe { (*self.as_ptr()).sreg };
        (0..8).zip(bits).fold(0, |all, (index, bit)| all | bit << index)
    }

    pub fn core(self) -> Core {
        // SAFETY: the instance is alive by the type's invariant.
        match unsafe { (*self.as_ptr()).state } as u32 {
            ffi::cpu_Running => Core::Running,
            ffi::cpu_Sleeping => Core::Sleeping,
            _ => Core::Stopped,
        }
    }

    /// The first error that simavr reported; it has ended the run.
    pub fn fault(self) -> Option<String> {
        // SAFETY: `control` lives as long as the instance; the reference ends with the clone.
        unsafe { (*self.control()).fault.clone() }
    }

    pub fn has_fault(self) -> bool {
        // SAFETY: `control` lives as long as the instance; nothing is borrowed beyond the check.
        unsafe { (*self.control()).fault.is_some() }
    }

    /// Resets the core and simavr's peripherals. The cycle counter restarts: the caller sets it back.
    pub fn reset(self) {
        // SAFETY: the instance is alive, and so is its `control`; callbacks use handles of their own.
        unsafe {
            (*self.control()).outputs.clear();
            ffi::avr_reset(self.as_ptr());
        }
    }

    /// From now on the instance reads its flash from `shared`, if that has the same length.
    ///
    /// # Safety
    /// `shared` lives as long as the instance, and the instance's program has no SPM: nothing else writes a
    /// flash.
    pub unsafe fn share_flash(self, shared: &[u8]) {
        if self.with_flash(<[u8]>::len) != shared.len() {
            return;
        }
        let avr = self.as_ptr();
        // SAFETY: the instance and its `control` are alive by the type's invariant; simavr has its own flash
        // from malloc, and `destroy` keeps it from freeing this one.
        unsafe {
            if !std::mem::replace(&mut (*self.control()).shares_flash, true) {
                free((*avr).flash.cast());
            }
            (*avr).flash = shared.as_ptr().cast_mut();
        }
    }

    /// The reset flags: of a power-on, of an external reset, of a brown-out and of the watchdog.
    pub fn reset_flags(self) -> [RegisterBits; 4] {
        // SAFETY: the instance is alive by the type's invariant.
        let flags = unsafe { (*self.as_ptr()).reset_flags };
        [flags.porf, flags.extrf, flags.borf, flags.wdrf].map(RegisterBits::from)
    }

    /// Sets the reset flag of `cause` in MCUCSR. Only power-on clears the other flags.
    pub fn note_reset(self, cause: Reset) {
        let [power_on, external, brown_out, watchdog] = self.reset_flags();
        let cause = match cause {
            Reset::PowerOn => {
                for bits in [external, brown_out, watchdog] {
                    self.set_bits(bits.address, bits.mask, false);
                }
                power_on
            }
            Reset::External => external,
            Reset::BrownOut => brown_out,
        };
        self.set_bits(cause.address, cause.mask, true);
    }

    /// Calls `visit` for each peripheral of simavr with its kind ("port", "watchdog", ...).
    pub fn peripherals(self, mut visit: impl FnMut(&str, *mut ffi::avr_io_t)) {
        // SAFETY: the list is simavr's own, ended by null; `kind` is a C string literal.
        unsafe {
            let mut next = (*self.as_ptr()).io_port;
            while !next.is_null() {
                let kind = CStr::from_ptr((*next).kind);
                visit(&kind.to_string_lossy(), next);
                next = (*next).next;
            }
        }
    }
}

/// Takes simavr's messages. Errors and stray accesses to memory end the run; all others are dropped.
unsafe extern "C" fn log(
    avr: *mut ffi::avr_t,
    level: c_int,
    format: *const c_char,
    arguments: *mut ffi::__va_list_tag,
) {
    if avr.is_null() || format.is_null() || level as u32 > ffi::LOG_WARNING {
        return;
    }
    // SAFETY: simavr passes a live instance, a C string and the arguments it calls for; the data
    // pointer is set before simavr can log about an instance and cleared after it is freed.
    unsafe {
        let stray_access = CStr::from_ptr(format).to_bytes().starts_with(b"CORE");
        let control: *mut Control = (*avr).custom.data.cast::<Control>();
        if control.is_null() || (*control).fault.is_some() {
            return;
        }
        if level as u32 == ffi::LOG_WARNING && !stray_access {
            return;
        }
        let mut text = [0_u8; 256];
        ffi::vsnprintf(text.as_mut_ptr().cast(), text.len() as _, format, arguments);
        let message = CStr::from_bytes_until_nul(&text).unwrap_or_default().to_string_lossy();
        (*control).fault = Some(message.trim_end().to_owned());
        Cpu::from_raw(avr).call_attention();
    }
}
