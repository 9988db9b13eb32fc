//! The registers of the interface (ATmega128 datasheet, "Two-wire Serial Interface").

use avr_device::atmega128a::TWI;
use kernel::Masked;

use super::control::INTERRUPT;
use super::status;
use crate::superbot::{CLOCK_HZ, I2C_HZ};

/// TWBR for a prescaler of 1: SCL has 16 + 2 * TWBR clocks (section "Bit Rate Generator Unit").
const BIT_RATE: u8 = {
    let bit_rate = (CLOCK_HZ / I2C_HZ - 16) / 2;
    assert!(bit_rate >= 10 && bit_rate <= 255, "as a master the interface needs a TWBR from 10 to 255");
    bit_rate as u8
};

#[inline(always)]
fn registers() -> TWI {
    // SAFETY: TWCR is written with interrupts masked, TWDR by the interrupt alone, the others before it
    // occurs.
    unsafe { TWI::steal() }
}

/// Sets the clock of the bus, [`I2C_HZ`].
pub fn set_bit_rate() {
    registers().twbr().write(|w| w.set(BIT_RATE));
}

/// Sets the MCU's own 7-bit address. The general call is not recognised.
pub fn set_own_address(address: u8) {
    // SAFETY: any address will do.
    registers().twar().write(|w| unsafe { w.bits(address << 1) });
}

/// TWSR: one of [`status`], and the bits of the prescaler.
#[inline(always)]
pub fn twsr() -> u8 {
    registers().twsr().read().bits()
}

/// TWSR without its prescaler bits: one of [`status`].
#[inline(always)]
pub fn status() -> u8 {
    twsr() & status::MASK
}

/// TWDR: the byte that was received.
#[inline(always)]
pub fn data() -> u8 {
    registers().twdr().read().bits()
}

/// TWDR: the byte to be sent.
#[inline(always)]
pub fn set_data(byte: u8) {
    registers().twdr().write(|w| w.set(byte));
}

/// TWCR.
#[inline(always)]
pub fn set_control(_: &Masked, bits: u8) {
    // SAFETY: the interface touches no memory, whatever its registers hold.
    registers().twcr().write(|w| unsafe { w.bits(bits) });
}

/// Sets `bits` of TWCR, and does not change a status that waits for its answer, nor a STOP that is under way.
///
/// A START that is requested while this MCU has the bus waits for the STOP: the interrupt makes sure of that,
/// since its answers decide what comes next.
pub fn request(masked: &Masked, bits: u8) {
    set_control(masked, registers().twcr().read().bits() & !INTERRUPT | bits);
}
