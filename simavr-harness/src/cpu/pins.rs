//! The pins of an instance.

use std::ffi::c_int;

use simavr_ffi as ffi;

use super::{Cpu, Driven, Outputs};
use crate::part::{Pin, Port};

/// Mask of a pin's level in the value that simavr signals; the bits above it tell what drives the pin.
pub(crate) const LEVEL: u32 = 0xff;

/// simavr's name for a request to a port: three letters and the port's own.
fn ioctl(kind: &[u8; 3], port: char) -> u32 {
    u32::from_be_bytes([kind[0], kind[1], kind[2], port as u8])
}

impl Cpu {
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

    /// Has a compare unit drive a pin to `level`, whatever the program writes to PORTx, until the pin is
    /// released.
    pub fn output_pin(self, port: Port, bit: u8, level: bool) {
        let mask = 1 << bit;
        let levels = self.data(port.register());
        self.with_outputs(port, |outputs| {
            if outputs.mask & mask == 0 {
                outputs.mask |= mask;
                outputs.latch = outputs.latch & !mask | levels & mask;
            }
            outputs.levels = if level { outputs.levels | mask } else { outputs.levels & !mask };
        });
        self.show_outputs(port);
        self.signal_pin(port.name, bit, ffi::AVR_IOPORT_OUTPUT | u32::from(level));
    }

    /// Gives a pin that a compare unit has driven back to PORTx.
    pub fn release_pin(self, port: Port, bit: u8) {
        self.show_outputs(port);
        let latch = self.with_outputs(port, |outputs| {
            outputs.mask &= !(1 << bit);
            outputs.latch
        });
        let level = latch >> bit & 1;
        self.signal_pin(port.name, bit, ffi::AVR_IOPORT_OUTPUT | u32::from(level));
    }

    /// PORTx for the program.
    pub fn read_port(self, port: Port) -> u8 {
        let Outputs { mask, latch, .. } = self.with_outputs(port, |outputs| *outputs);
        self.data(port.register()) & !mask | latch & mask
    }

    /// PINx for the program.
    pub fn read_pins(self, port: Port) -> u8 {
        self.show_outputs(port);
        let outputs = self.data(port.direction());
        self.data(port.register()) & outputs | self.data(port.pins) & !outputs
    }

    /// The program writes `value` to PORTx. Returns what simavr is to hold there.
    pub fn write_port(self, port: Port, value: u8) -> u8 {
        let Outputs { mask, levels, .. } = self.with_outputs(port, |outputs| {
            outputs.latch = value;
            *outputs
        });
        value & !mask | levels & mask
    }

    /// Puts the levels of compare units into PORTx, from which simavr drives pins. After the program has read
    /// it, PORTx holds what was read.
    pub fn show_outputs(self, port: Port) {
        let Outputs { mask, levels, .. } = self.with_outputs(port, |outputs| *outputs);
        let held = self.data(port.register());
        self.set_data(port.register(), held & !mask | levels & mask);
    }

    fn with_outputs<R>(self, port: Port, act: impl FnOnce(&mut Outputs) -> R) -> R {
        // SAFETY: `control` lives as long as the instance, and `act` has no handle that leads here.
        act(unsafe { (*self.control()).outputs.entry(port.name).or_default() })
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

    /// Disconnects simavr's external interrupt from a pin, which has the same number.
    pub fn disconnect_external_interrupt(self, pin: Pin) {
        // SAFETY: both signals live as long as the instance.
        unsafe {
            let number = c_int::from(pin.bit);
            let interrupt = ffi::avr_io_getirq(self.as_ptr(), u32::from_be_bytes(*b"int "), number);
            ffi::avr_unconnect_irq(self.pin_irq(pin.port, pin.bit), interrupt);
        }
    }

    /// Whether nothing gives a pin a level: neither the outside nor the program, as an output or by its
    /// pull-up.
    pub fn is_floating(self, pin: Pin) -> bool {
        // SAFETY: `control` lives as long as the instance, and nothing changes it while the reference lives.
        let driven = unsafe { &(*self.control()).driven };
        let is_driven = driven.get(&pin.port).is_some_and(|port| port.mask & 1 << pin.bit != 0);
        let state = self.port_state(pin.port);
        !is_driven && (state.port() | state.ddr()) & 1 << pin.bit == 0
    }

    /// The level of each pin of a port as it could be measured outside: the output latch where the
    /// pin is an output, the input elsewhere.
    pub fn pins(self, port: char) -> u8 {
        let state = self.port_state(port);
        let (latch, direction, input) = (state.port() as u8, state.ddr() as u8, state.pin() as u8);
        // SAFETY: `control` lives as long as the instance, and nothing changes it while the reference lives.
        let outputs = unsafe { &(*self.control()).outputs }.get(&port).copied().unwrap_or_default();
        let latch = latch & !outputs.mask | outputs.levels & outputs.mask;
        latch & direction | input & !direction
    }

    /// The level of a pin as it could be measured.
    pub fn is_high(self, pin: Pin) -> bool {
        self.pins(pin.port) & 1 << pin.bit != 0
    }

    fn port_state(self, port: char) -> ffi::avr_ioport_state_t {
        // SAFETY: the structure holds integers only, for which zero is a value.
        let mut state: ffi::avr_ioport_state_t = unsafe { std::mem::zeroed() };
        // SAFETY: simavr fills `state` in if the part has the port, and leaves it alone if not.
        unsafe { ffi::avr_ioctl(self.as_ptr(), ioctl(b"ios", port), (&raw mut state).cast()) };
        state
    }
}
