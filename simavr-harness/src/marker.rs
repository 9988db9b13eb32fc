//! Markers: bytes that a program reports to the harness by an `out` to a register without any effect.

use crate::cpu::Cpu;
use crate::device::{Attached, Device};

/// One write to the part's register for markers: OCDR on the ATmega128 (I/O 0x22), GPIOR0 on the others (I/O
/// 0x1e).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Marker {
    /// Cycle at which the `out` began, which takes one cycle.
    pub cycle: u64,
    pub value: u8,
}

/// The register for markers. It keeps the value that is written to it.
#[derive(Default)]
pub(crate) struct Markers {
    pub log: Vec<Marker>,
    /// Ends the run at each marker.
    pub stop: bool,
}

pub(crate) fn attach(cpu: Cpu, register: u16) -> Attached<Markers> {
    Attached::new(cpu, Markers::default(), &[register], &[])
}

impl Device for Markers {
    fn write(&mut self, cpu: Cpu, address: u16, value: u8) {
        cpu.set_data(address, value);
        self.log.push(Marker { cycle: cpu.cycle(), value });
        if self.stop {
            cpu.call_attention();
        }
    }
}
