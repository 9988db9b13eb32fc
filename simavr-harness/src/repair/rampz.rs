//! RAMPZ (ATmega128 datasheet, "AVR CPU Core"): it has as many bits as it takes to say which 64 KB of the
//! flash are meant; the others read 0. simavr keeps them all, and reads beyond its flash.

use crate::cpu::Cpu;
use crate::device::WrappedWrites;

/// Bytes that Z reaches by itself.
const PAGE: usize = 0x1_0000;

/// Has writes leave the bits out that there are not.
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
