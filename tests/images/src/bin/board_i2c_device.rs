//! A device with sixteen registers at the I2C address 0x48, for the images that use one.
//!
//! The first byte written sets which register comes next; further bytes are stored from there on, and are
//! refused after the sixteenth register. A read continues at the same register; after the last one it returns
//! ones. At power-up each register holds its number plus 0x80.
//!
//! Marks: each status of its interface, as the datasheet numbers them.
//!
//! It stands for a part that does not belong to this robot. So it uses neither the board's code nor the
//! kernel, and polls.
#![no_std]
#![no_main]

use core::ptr;

use board::debug::mark;
use tests_images as _;

const ADDRESS: u8 = 0x48;
const REGISTERS: u8 = 16;

// The two-wire interface (ATmega128 datasheet, "Register Summary").
const TWSR: usize = 0x71;
const TWAR: usize = 0x72;
const TWDR: usize = 0x73;
const TWCR: usize = 0x74;

/// TWCR: TWINT, with the interface enabled.
const GO_ON: u8 = 1 << 7 | 1 << 2;
/// TWCR: TWINT.
const STATUS_IS_NEW: u8 = 1 << 7;
/// TWCR: TWEA.
const ACKNOWLEDGE: u8 = 1 << 6;

fn read(register: usize) -> u8 {
    // SAFETY: the address is that of a register above, which nothing else uses.
    unsafe { ptr::with_exposed_provenance::<u8>(register).read_volatile() }
}

fn write(register: usize, value: u8) {
    // SAFETY: the address is that of a register above, which nothing else uses; the interface touches no memory.
    unsafe { ptr::with_exposed_provenance_mut::<u8>(register).write_volatile(value) }
}

struct Device {
    registers: [u8; REGISTERS as usize],
    /// The next register.
    next: u8,
    /// Whether the next byte written is the number of a register.
    is_number: bool,
}

impl Device {
    /// Whether the device accepts the next byte written.
    fn accepts(&self) -> bool {
        self.is_number || self.next < REGISTERS
    }

    fn store(&mut self, byte: u8) {
        if self.is_number {
            self.is_number = false;
            self.next = byte;
        } else if let Some(register) = self.registers.get_mut(usize::from(self.next)) {
            *register = byte;
            self.next += 1;
        }
    }

    fn fetch(&mut self) -> u8 {
        let byte = self.registers.get(usize::from(self.next)).copied().unwrap_or(0xff);
        self.next = self.next.saturating_add(1);
        byte
    }
}

#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    let mut device = Device { registers: [0; REGISTERS as usize], next: 0, is_number: false };
    for (register, number) in device.registers.iter_mut().zip(0x80..) {
        *register = number;
    }
    write(TWAR, ADDRESS << 1);
    write(TWCR, GO_ON | ACKNOWLEDGE);
    loop {
        while read(TWCR) & STATUS_IS_NEW == 0 {}
        let status = read(TWSR);
        mark(status);
        match status {
            0x60 => device.is_number = true,            // addressed, to be written
            0x80 => device.store(read(TWDR)),           // a byte has come
            0xa8 | 0xb8 => write(TWDR, device.fetch()), // addressed, to be read; or the byte was taken
            _ => device.is_number = true,               // it is over: the own address is acknowledged again
        }
        write(TWCR, if device.accepts() { GO_ON | ACKNOWLEDGE } else { GO_ON });
    }
}
