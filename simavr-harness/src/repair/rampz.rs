//! RAMPZ (ATmega128 datasheet, "AVR CPU Core") has as many bits as it takes to select 64 KB of the flash; the
//! others read 0. simavr keeps all eight bits, and reads beyond its flash.

use crate::cpu::Cpu;
use crate::device::WrappedWrites;

/// Bytes that Z can address by itself.
const PAGE: usize = 0x1_0000;

/// Makes writes drop the bits that do not exist.
pub(crate) fn install(cpu: Cpu, wrapped: &mut WrappedWrites) {
    if let Some(rampz) = cpu.rampz() {
        wrapped.wrap(cpu, rampz, keep_what_there_is);
    }
}

fn keep_what_there_is(cpu: Cpu, rampz: u16, _before: u8, written: u8) {
    let pages = cpu.flash_size().div_ceil(PAGE);
    cpu.set_data(rampz, written & (pages - 1) as u8);
}

#[cfg(test)]
mod tests;
