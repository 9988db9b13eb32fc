//! Replaces peripherals of simavr by the harness's own: the callbacks, and the ownership of the data to which
//! they point.

use std::ffi::{c_int, c_void};
use std::ptr::{self, NonNull};

use simavr_ffi as ffi;

use crate::cpu::{Cpu, IO_START, LEVEL};

/// A peripheral that the harness owns. It handles the registers given to it, and may ask to be called
/// at a cycle.
pub(crate) trait Device {
    /// The program writes `value` to `address`. The device stores the value that a later read returns
    /// ([`Cpu::set_data`]).
    fn write(&mut self, cpu: Cpu, address: u16, value: u8);

    /// The program reads `address`.
    fn read(&mut self, cpu: Cpu, address: u16) -> u8 {
        cpu.data(address)
    }

    /// The cycle at which the device next acts by itself.
    fn due(&self) -> Option<u64> {
        None
    }

    /// The cycle `now`, which [`Device::due`] gave, has come. The core may have passed it by less than an
    /// instruction.
    fn expire(&mut self, _cpu: Cpu, _now: u64) {}

    /// The watched pin at `_bit` of its port has level `_level` now, perhaps the same as before.
    fn pin_changed(&mut self, _cpu: Cpu, _bit: u8, _level: bool) {}
}

/// A device that is attached to an instance: simavr calls it while the program runs, the harness between
/// runs.
pub(crate) struct Attached<D: Device>(NonNull<Slot<D>>);

struct Slot<D> {
    device: D,
    /// The cycle for which simavr holds a timer.
    armed: Option<u64>,
}

/// A device at one moment.
pub(crate) struct Saved<D> {
    device: D,
    armed: Option<u64>,
}

// SAFETY: the slot has one owner, and simavr calls into it only on the thread that runs the MCU to
// which the owner belongs.
unsafe impl<D: Device + Send> Send for Attached<D> {}

impl<D: Device> Attached<D> {
    /// Takes over the writes to `writes` and the reads of `reads`.
    pub fn new(cpu: Cpu, device: D, writes: &[u16], reads: &[u16]) -> Self {
        let slot = NonNull::from(Box::leak(Box::new(Slot { device, armed: None })));
        for &address in reads {
            // SAFETY: the slot outlives the instance's last run: both belong to one `Mcu`.
            unsafe { set_read(cpu, address, Some(read::<D>), slot.as_ptr().cast()) };
        }
        let attached = Self(slot);
        attached.take_writes(cpu, writes);
        attached
    }

    /// Takes over the writes to more registers.
    pub fn take_writes(&self, cpu: Cpu, writes: &[u16]) {
        for &address in writes {
            // SAFETY: the slot outlives the instance's last run: both belong to one `Mcu`.
            unsafe { set_write(cpu, address, Some(write::<D>), self.0.as_ptr().cast()) };
        }
    }

    /// Signals the levels of a pin to the device from now on.
    pub fn watch_pin(&self, cpu: Cpu, port: char, bit: u8) {
        // SAFETY: the slot outlives the instance's last run; simavr ignores a pin that is null.
        unsafe {
            ffi::avr_irq_register_notify(
                cpu.pin_irq(port, bit),
                Some(pin_changed::<D>),
                self.0.as_ptr().cast(),
            );
        }
    }

    pub fn get(&self) -> &D {
        // SAFETY: callbacks run only inside a run of the MCU, which borrows the owner exclusively.
        unsafe { &self.0.as_ref().device }
    }

    /// Works on the device from outside a run. Actions of the device that fall due by this happen at once.
    pub fn with<R>(&mut self, cpu: Cpu, work: impl FnOnce(&mut D) -> R) -> R {
        // SAFETY: callbacks run only inside a run of the MCU, which borrows the owner, as this does.
        let slot = unsafe { self.0.as_mut() };
        let result = work(&mut slot.device);
        slot.catch_up(cpu);
        slot.arm(cpu, self.0.as_ptr());
        result
    }

    /// The device as it is, to be restored later.
    pub fn save(&self) -> Saved<D>
    where
        D: Clone,
    {
        // SAFETY: callbacks run only inside a run of the MCU, which borrows the owner exclusively.
        let slot = unsafe { self.0.as_ref() };
        Saved { device: slot.device.clone(), armed: slot.armed }
    }

    /// Restores the device, after simavr's timers have been restored to the same moment.
    pub fn restore(&mut self, saved: Saved<D>) {
        // SAFETY: callbacks run only inside a run of the MCU, which borrows the owner, as this does.
        let slot = unsafe { self.0.as_mut() };
        (slot.device, slot.armed) = (saved.device, saved.armed);
    }

    /// Forgets the timer that was set, after a reset has dropped simavr's timers.
    pub fn forget_timer(&mut self) {
        // SAFETY: callbacks run only inside a run of the MCU, which borrows the owner, as this does.
        unsafe { self.0.as_mut() }.armed = None;
    }
}

impl<D: Device> Drop for Attached<D> {
    fn drop(&mut self) {
        // SAFETY: the slot came from a Box, and the instance that points to it does not run again.
        drop(unsafe { Box::from_raw(self.0.as_ptr()) });
    }
}

impl<D: Device> Slot<D> {
    fn catch_up(&mut self, cpu: Cpu) {
        while let Some(due) = self.device.due().filter(|&due| due <= cpu.cycle()) {
            self.device.expire(cpu, due);
        }
    }

    /// Brings simavr's timer into line with what the device asks for.
    fn arm(&mut self, cpu: Cpu, parameter: *mut Self) {
        let due = self.device.due();
        if due == self.armed {
            return;
        }
        self.armed = due;
        // SAFETY: `parameter` is this slot, which outlives the instance's last run.
        unsafe {
            match due {
                Some(due) => ffi::avr_cycle_timer_register(
                    cpu.as_ptr(),
                    due.saturating_sub(cpu.cycle()),
                    Some(expire::<D>),
                    parameter.cast(),
                ),
                None => ffi::avr_cycle_timer_cancel(cpu.as_ptr(), Some(expire::<D>), parameter.cast()),
            }
        }
        cpu.keep_deadline();
    }
}

unsafe extern "C" fn write<D: Device>(
    avr: *mut ffi::avr_t,
    address: ffi::avr_io_addr_t,
    value: u8,
    parameter: *mut c_void,
) {
    let parameter = parameter.cast::<Slot<D>>();
    // SAFETY: simavr passes its own instance and the slot registered with it, which nobody else
    // uses during a run.
    let (cpu, slot) = unsafe { (Cpu::from_raw(avr), &mut *parameter) };
    slot.device.write(cpu, address, value);
    slot.arm(cpu, parameter);
}

unsafe extern "C" fn read<D: Device>(
    avr: *mut ffi::avr_t,
    address: ffi::avr_io_addr_t,
    parameter: *mut c_void,
) -> u8 {
    let parameter = parameter.cast::<Slot<D>>();
    // SAFETY: simavr passes its own instance and the slot registered with it, which nobody else
    // uses during a run.
    let (cpu, slot) = unsafe { (Cpu::from_raw(avr), &mut *parameter) };
    let value = slot.device.read(cpu, address);
    slot.arm(cpu, parameter);
    value
}

/// Returns the cycle of the next call; 0 for none.
unsafe extern "C" fn expire<D: Device>(
    avr: *mut ffi::avr_t,
    _when: ffi::avr_cycle_count_t,
    parameter: *mut c_void,
) -> ffi::avr_cycle_count_t {
    let parameter = parameter.cast::<Slot<D>>();
    // SAFETY: simavr passes its own instance and the slot registered with it, which nobody else
    // uses during a run.
    let (cpu, slot) = unsafe { (Cpu::from_raw(avr), &mut *parameter) };
    slot.catch_up(cpu);
    slot.armed = slot.device.due();
    slot.armed.unwrap_or(0)
}

unsafe extern "C" fn pin_changed<D: Device>(irq: *mut ffi::avr_irq_t, value: u32, parameter: *mut c_void) {
    let parameter = parameter.cast::<Slot<D>>();
    // SAFETY: the signal's pool leads to the instance, and the slot was registered with the signal, whose
    // number is the pin's. simavr changes a watched pin only while the program runs, and never inside the
    // device that watches it.
    let (cpu, slot, bit) = unsafe { (Cpu::from_raw((*(*irq).pool).avr), &mut *parameter, (*irq).irq as u8) };
    slot.device.pin_changed(cpu, bit, value & LEVEL != 0);
    slot.arm(cpu, parameter);
}

/// simavr's own write handlers, each with a change of the value before it, and an action after it.
#[derive(Default)]
pub(crate) struct WrappedWrites(Vec<NonNull<WrappedWrite>>);

struct WrappedWrite {
    handler: ffi::avr_io_write_t,
    parameter: *mut c_void,
    before: Before,
    after: After,
}

/// What simavr's handler gets in place of the value written, with which it is called.
type Before = Box<dyn Fn(Cpu, u8) -> u8 + Send>;

/// The action after a write, called with the address, the value before the write and the value written.
type After = Box<dyn Fn(Cpu, u16, u8, u8) + Send>;

// SAFETY: each entry has one owner, and simavr calls into it only on the thread that runs the MCU to which
// the owner belongs.
unsafe impl Send for WrappedWrites {}

impl WrappedWrites {
    /// Calls `after` after each write to `address`. Where simavr has no handler the value is stored.
    pub fn wrap(&mut self, cpu: Cpu, address: u16, after: impl Fn(Cpu, u16, u8, u8) + Send + 'static) {
        self.wrap_with(cpu, address, Box::new(|_, written| written), Box::new(after));
    }

    /// Has `before` replace the values written to `address`.
    pub fn replace(&mut self, cpu: Cpu, address: u16, before: impl Fn(Cpu, u8) -> u8 + Send + 'static) {
        self.wrap_with(cpu, address, Box::new(before), Box::new(|_, _, _, _| {}));
    }

    fn wrap_with(&mut self, cpu: Cpu, address: u16, before: Before, after: After) {
        // SAFETY: the entry outlives the instance's last run: both belong to one `Mcu`.
        unsafe {
            let entry = (*cpu.as_ptr()).io[usize::from(address - IO_START)].w;
            let wrapped = WrappedWrite { handler: entry.c, parameter: entry.param, before, after };
            let wrapped = NonNull::from(Box::leak(Box::new(wrapped)));
            set_write(cpu, address, Some(wrapped_write), wrapped.as_ptr().cast());
            self.0.push(wrapped);
        }
    }
}

impl Drop for WrappedWrites {
    fn drop(&mut self) {
        for wrapped in self.0.drain(..) {
            // SAFETY: it came from a Box, and the instance that points to it does not run again.
            drop(unsafe { Box::from_raw(wrapped.as_ptr()) });
        }
    }
}

unsafe extern "C" fn wrapped_write(
    avr: *mut ffi::avr_t,
    address: ffi::avr_io_addr_t,
    value: u8,
    parameter: *mut c_void,
) {
    // SAFETY: simavr passes its own instance and the entry registered with it, which stays
    // unchanged; the handler inside is simavr's own with its own parameter.
    unsafe {
        let cpu = Cpu::from_raw(avr);
        let wrapped = &*parameter.cast::<WrappedWrite>();
        let before = cpu.data(address);
        let value = (wrapped.before)(cpu, value);
        match wrapped.handler {
            Some(handler) => handler(avr, address, value, wrapped.parameter),
            None => cpu.set_data(address, value),
        }
        (wrapped.after)(cpu, address, before, value);
        cpu.keep_deadline();
    }
}

/// Whether simavr has a write handler at `address`.
pub(crate) fn has_write_handler(cpu: Cpu, address: u16) -> bool {
    // SAFETY: the instance is alive; the index is checked.
    unsafe { (*cpu.as_ptr()).io[usize::from(address - IO_START)].w.c.is_some() }
}

/// Makes the registers at `addresses` plain memory, whatever simavr did with them.
pub(crate) fn make_plain(cpu: Cpu, addresses: &[u16]) {
    for &address in addresses {
        // SAFETY: with no handler simavr reads and stores the value by itself.
        unsafe {
            set_write(cpu, address, None, ptr::null_mut());
            set_read(cpu, address, None, ptr::null_mut());
        }
    }
}

/// Makes the register at `address` ignore writes, those to single bits too. It is read as before.
pub(crate) fn ignore_writes(cpu: Cpu, address: u16) {
    // SAFETY: the handler takes any parameter.
    unsafe { set_write(cpu, address, Some(ignore), ptr::null_mut()) };
    // SAFETY: the instance is alive by the invariant of `Cpu`, and the reference ends here.
    let bits = unsafe { &mut (*cpu.as_ptr()).bit_io };
    if let Some(handler) = bits.get_mut(usize::from(address - IO_START)) {
        handler.c = None;
    }
}

/// Makes SBI and CBI of the bits of the register at `address` that have no handler of their own in simavr's
/// list do nothing: simavr would call a null pointer.
///
/// # Safety
/// simavr keeps a list of handlers for that register, one for each bit.
pub(crate) unsafe fn ignore_other_bits(cpu: Cpu, address: u16) {
    // SAFETY: the instance is alive by the invariant of `Cpu`; the caller vouches for the list, and the
    // reference ends here.
    let list = unsafe {
        let list = (*cpu.as_ptr()).bit_io[usize::from(address - IO_START)].param;
        NonNull::new(list.cast::<[ffi::bit_cb; 8]>()).map(|mut list| list.as_mut())
    };
    for bit in list.into_iter().flatten().filter(|bit| bit.c.is_none()) {
        bit.c = Some(ignore_bit);
    }
}

/// Makes SBI write a one to that bit of the register at `address` alone, and CBI do nothing.
pub(crate) fn write_single_ones(cpu: Cpu, address: u16) {
    // SAFETY: the instance is alive by the invariant of `Cpu`, and the reference ends here.
    let bits = unsafe { &mut (*cpu.as_ptr()).bit_io };
    if let Some(handler) = bits.get_mut(usize::from(address - IO_START)) {
        handler.c = Some(write_single_one);
        handler.param = ptr::without_provenance_mut(address.into());
    }
}

unsafe extern "C" fn write_single_one(
    avr: *mut ffi::avr_t,
    bit: u8,
    level: u8,
    address: *mut c_void,
) -> c_int {
    if level != 0 {
        // SAFETY: simavr passes its own instance.
        let cpu = unsafe { Cpu::from_raw(avr) };
        cpu.write_handled(address.addr() as u16, 1 << bit);
    }
    1
}

unsafe extern "C" fn ignore_bit(_: *mut ffi::avr_t, _: u8, _: u8, _: *mut c_void) -> c_int {
    1
}

unsafe extern "C" fn ignore(_: *mut ffi::avr_t, _: ffi::avr_io_addr_t, _: u8, _: *mut c_void) {}

/// # Safety
/// `handler` may be called with `parameter` as long as the instance runs.
unsafe fn set_write(cpu: Cpu, address: u16, handler: ffi::avr_io_write_t, parameter: *mut c_void) {
    // SAFETY: the instance is alive by the invariant of `Cpu`; the index is checked.
    unsafe {
        let entry = &mut (*cpu.as_ptr()).io[usize::from(address - IO_START)].w;
        entry.c = handler;
        entry.param = parameter;
    }
}

/// # Safety
/// `handler` may be called with `parameter` as long as the instance runs.
unsafe fn set_read(cpu: Cpu, address: u16, handler: ffi::avr_io_read_t, parameter: *mut c_void) {
    // SAFETY: the instance is alive by the invariant of `Cpu`; the index is checked.
    unsafe {
        let entry = &mut (*cpu.as_ptr()).io[usize::from(address - IO_START)].r;
        entry.c = handler;
        entry.param = parameter;
    }
}
