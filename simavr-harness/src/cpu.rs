//! A thin layer over one simavr instance. Every dereference of simavr's structures is in this file, in
//! `registers` and `snapshot` below it, in `device`, or in `repair/watchdog`.
//!
//! A [`Cpu`] is a handle, copied freely between the harness and the callbacks that simavr makes into
//! it. No Rust reference into simavr's memory outlives the method that makes it, so a callback may
//! use its own handle during a [`run`](crate::execution::run).

use std::collections::BTreeMap;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::ptr::NonNull;
use std::sync::Once;
use std::sync::atomic::{AtomicU64, Ordering};

use instruction_set::Instruction::{Elpm, ElpmIncrement};
use simavr_ffi as ffi;

mod registers;
mod snapshot;

pub use registers::Registers;
pub(crate) use registers::{Access, CoreState, IO_START};

// Missing from simavr-ffi's bindings.
unsafe extern "C" {
    fn avr_run_one(avr: *mut ffi::avr_t) -> ffi::avr_flashaddr_t;
    /// The C library's, for what simavr allocated.
    fn free(allocated: *mut c_void);
}

/// Index of the I flag in SREG.
const INTERRUPT_FLAG: usize = 7;

/// Bytes of the opcode that simavr keeps after the end of the flash.
const OVERFLOW_OPCODE: usize = 2;

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

/// An interrupt vector of one instance, under the invariant of [`Cpu`].
#[derive(Clone, Copy)]
pub(crate) struct Vector(NonNull<ffi::avr_int_vector_t>);

// SAFETY: by the invariant of `Cpu` all vectors belong to one `Mcu`, and so move with it.
unsafe impl Send for Vector {}

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

/// Bits of one register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RegisterBits {
    pub address: u16,
    pub mask: u8,
}

/// An event at a device of an MCU, for which the bus or the robot polls. Each kind has a pending flag; all
/// flags are in one place, so that a poll reads no device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum News {
    /// The two-wire interface was reset, or the program wrote a register of it.
    Bus,
    /// A serial port has sent a character.
    Sent,
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
}

/// The pins of a port that the outside drives, and their levels.
#[derive(Clone, Copy, Default)]
struct Driven {
    mask: u8,
    levels: u8,
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

    // --- Running --------------------------------------------------------------------------------

    /// Begins a run. It ends at `deadline` or at the next cycle timer, whichever comes first, but not before
    /// one instruction. Returns whether simavr has to look at the core before the core executes anything.
    pub fn begin_run(self, deadline: u64) -> bool {
        let avr = self.as_ptr();
        // SAFETY: the instance is alive by the type's invariant; no simavr code runs meanwhile.
        unsafe {
            (*self.control()).deadline = deadline;
            let left = deadline.saturating_sub((*avr).cycle).max(1);
            // simavr's own count dates from before a sleep or an interrupt's response.
            let to_timer = self.next_timer().map_or(left, |when| when.saturating_sub((*avr).cycle));
            (*avr).run_cycle_limit = left;
            (*avr).run_cycle_count = to_timer.clamp(1, left);
        }
        self.must_pause()
    }

    /// Ends the run that has begun after its next instruction, even if that sets a timer as WDR does: simavr
    /// then restarts its count, up to the limit.
    pub fn run_for_one_instruction(self) {
        let avr = self.as_ptr();
        // SAFETY: the instance is alive by the type's invariant.
        unsafe {
            (*avr).run_cycle_limit = 1;
            (*avr).run_cycle_count = 1;
        }
    }

    /// Executes the run that has begun by simavr's own interpreter.
    pub fn run_by_simavr(self) {
        if self.rampz().is_none() {
            // A part without RAMPZ has no ELPM: simavr reports that, and then reads far beyond its flash.
            self.run_for_one_instruction();
            if self.is_before_elpm() {
                return self.report("Invalid Opcode: ELPM without RAMPZ");
            }
        }
        let avr = self.as_ptr();
        // SAFETY: the instance is alive, and no reference into it exists across the call: callbacks use
        // handles of their own.
        unsafe { (*avr).pc = avr_run_one(avr) }
    }

    /// Whether the next instruction is ELPM.
    fn is_before_elpm(self) -> bool {
        let pc = self.pc() as usize;
        let opcode =
            self.with_flash(|flash| flash.get(pc..)?.first_chunk().map(|&word| u16::from_le_bytes(word)));
        opcode.is_some_and(|opcode| {
            matches!(instruction_set::decode(0, opcode, 0), Elpm { .. } | ElpmIncrement { .. })
        })
    }

    /// Ends the run with an error, unless simavr has reported one.
    fn report(self, error: &str) {
        // SAFETY: `control` lives as long as the instance; the reference ends here.
        unsafe { (*self.control()).fault.get_or_insert_with(|| error.to_owned()) };
        self.call_attention();
    }

    /// Holds a run to its deadline. simavr forgets how much of the run has passed whenever a timer
    /// is registered; every callback that may have done so ends with this.
    pub fn keep_deadline(self) {
        let avr = self.as_ptr();
        // SAFETY: the instance and its `control` are alive by the type's invariant.
        unsafe {
            let control = self.control();
            let left =
                if (*control).attention { 0 } else { (*control).deadline.saturating_sub((*avr).cycle) };
            (*avr).run_cycle_count = (*avr).run_cycle_count.min(left);
        }
    }

    /// Ends the run after the instruction in progress, so that the harness can look at a device.
    pub fn call_attention(self) {
        // SAFETY: the instance and its `control` are alive by the type's invariant.
        unsafe { (*self.control()).attention = true }
        self.keep_deadline();
    }

    /// Whether a device called for attention.
    pub fn attention(self) -> bool {
        // SAFETY: `control` lives as long as the instance.
        unsafe { (*self.control()).attention }
    }

    pub fn clear_attention(self) {
        // SAFETY: `control` lives as long as the instance.
        unsafe { (*self.control()).attention = false }
    }

    /// Sets the pending flag of an event.
    pub fn tell(self, news: News) {
        // SAFETY: `control` lives as long as the instance.
        unsafe { (*self.control()).news[news as usize] = true }
    }

    /// Whether an event is pending.
    pub fn has(self, news: News) -> bool {
        // SAFETY: `control` lives as long as the instance.
        unsafe { (*self.control()).news[news as usize] }
    }

    /// Clears the pending flag of an event. Returns whether it was set.
    pub fn take(self, news: News) -> bool {
        // SAFETY: `control` lives as long as the instance; the reference ends with the call.
        unsafe { std::mem::take(&mut (*self.control()).news[news as usize]) }
    }

    /// Fires the cycle timers that are due; returns the cycles to the next one (1000 if none).
    pub fn process_timers(self) -> u64 {
        // SAFETY: the instance is alive; callbacks use handles of their own.
        unsafe { ffi::avr_cycle_timer_process(self.as_ptr()) }
    }

    /// Cycle of the earliest cycle timer.
    pub fn next_timer(self) -> Option<u64> {
        // SAFETY: the instance is alive; `timer` is null or a slot of its own pool.
        unsafe { (*self.as_ptr()).cycle_timers.timer.as_ref().map(|slot| slot.when) }
    }

    /// Resets the core and simavr's peripherals. The cycle counter restarts: the caller sets it back.
    pub fn reset(self) {
        // SAFETY: the instance is alive; callbacks use handles of their own.
        unsafe { ffi::avr_reset(self.as_ptr()) }
    }

    // --- Memory ---------------------------------------------------------------------------------

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

    // --- Interrupts -----------------------------------------------------------------------------

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

    // --- Pins -----------------------------------------------------------------------------------

    /// Drives a pin from outside to `level`, until the next call for that pin.
    pub fn drive_pin(self, port: char, bit: u8, level: bool) {
        // SAFETY: `control` lives as long as the instance, and the reference ends here.
        let driven = unsafe { &mut (*self.control()).driven };
        let of_port = driven.entry(port).or_default();
        let mask = 1 << bit;
        of_port.mask |= mask;
        of_port.levels = if level { of_port.levels | mask } else { of_port.levels & !mask };
        let of_port = *of_port;
        self.raise_pin(port, bit, level, of_port);
    }

    /// Restores the levels of all pins that the outside drives, after a reset has dropped them.
    pub fn restore_pins(self) {
        // SAFETY: `control` lives as long as the instance, and the reference ends with the clone.
        let driven = unsafe { (*self.control()).driven.clone() };
        for (port, of_port) in driven {
            for bit in (0..8).filter(|bit| of_port.levels & 1 << bit != 0) {
                self.raise_pin(port, bit, true, of_port);
            }
        }
    }

    /// Tells simavr which pins of the port are driven, so that no internal pull-up overrides them, and then
    /// raises the level of one pin.
    fn raise_pin(self, port: char, bit: u8, level: bool, driven: Driven) {
        // SAFETY: the structure holds integers only, for which zero is a value.
        let mut pull: ffi::avr_ioport_external_t = unsafe { std::mem::zeroed() };
        pull.set_name(port as _);
        pull.set_mask(driven.mask.into());
        pull.set_value(driven.levels.into());
        // SAFETY: simavr reads `pull` during the call only.
        unsafe { ffi::avr_ioctl(self.as_ptr(), ioctl(b"iop", port), (&raw mut pull).cast()) };
        self.signal_pin(port, bit, level.into());
    }

    /// simavr's signal of a pin; null if the part does not have it.
    pub fn pin_irq(self, port: char, bit: u8) -> *mut ffi::avr_irq_t {
        // SAFETY: simavr looks up the pin by itself.
        unsafe { ffi::avr_io_getirq(self.as_ptr(), ioctl(b"iog", port), c_int::from(bit)) }
    }

    /// Signals a value at a pin; nothing if the part does not have it.
    fn signal_pin(self, port: char, bit: u8, value: u32) {
        let pin = self.pin_irq(port, bit);
        if !pin.is_null() {
            // SAFETY: the signal lives as long as the instance.
            unsafe { ffi::avr_raise_irq(pin, value) }
        }
    }

    /// Sets a pin to the level that a compare unit outputs.
    pub fn output_pin(self, port: char, bit: u8, level: bool) {
        self.signal_pin(port, bit, ffi::AVR_IOPORT_OUTPUT | u32::from(level));
    }

    /// Disconnects the capture unit of simavr's timer `timer` from a pin.
    pub fn disconnect_capture(self, timer: char, port: char, bit: u8) {
        // SAFETY: both signals live as long as the instance.
        unsafe {
            let input = ffi::TIMER_IRQ_IN_ICP as c_int;
            let capture = ffi::avr_io_getirq(self.as_ptr(), ioctl(b"tmr", timer), input);
            ffi::avr_unconnect_irq(self.pin_irq(port, bit), capture);
        }
    }

    /// Passes only the bare level of a pin to the external interrupt there, which has the same number as the
    /// pin.
    pub fn show_external_interrupt_levels_only(self, port: char, bit: u8) {
        // SAFETY: both signals live as long as the instance, and `show_level` takes the second one.
        unsafe {
            let interrupt = ffi::avr_io_getirq(self.as_ptr(), u32::from_be_bytes(*b"int "), c_int::from(bit));
            let pin = self.pin_irq(port, bit);
            ffi::avr_unconnect_irq(pin, interrupt);
            ffi::avr_irq_register_notify(pin, Some(show_level), interrupt.cast());
        }
    }

    /// The level of each pin of a port as it could be measured outside: the output latch where the
    /// pin is an output, the input elsewhere.
    pub fn pins(self, port: char) -> u8 {
        // SAFETY: the structure holds integers only, for which zero is a value.
        let mut state: ffi::avr_ioport_state_t = unsafe { std::mem::zeroed() };
        // SAFETY: simavr fills `state` in if the part has the port, and leaves it alone if not.
        unsafe { ffi::avr_ioctl(self.as_ptr(), ioctl(b"ios", port), (&raw mut state).cast()) };
        let (latch, direction, input) = (state.port(), state.ddr(), state.pin());
        (latch & direction | input & !direction) as u8
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

/// simavr's name for a request to a port: three letters and the port's own.
fn ioctl(kind: &[u8; 3], port: char) -> u32 {
    u32::from_be_bytes([kind[0], kind[1], kind[2], port as u8])
}

/// Mask of a pin's level in the value that simavr signals; the bits above it tell what drives the pin.
pub(crate) const LEVEL: u32 = 0xff;

/// Passes a pin's level on to the signal in `parameter`.
unsafe extern "C" fn show_level(_pin: *mut ffi::avr_irq_t, value: u32, parameter: *mut c_void) {
    // SAFETY: `show_external_interrupt_levels_only` registered this with a signal of the same instance.
    unsafe { ffi::avr_raise_irq(parameter.cast(), (value & LEVEL != 0).into()) }
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
