//! Markers: what a program tells the harness by writing to a register that does nothing, one `out`.

use crate::cpu::Cpu;
use crate::device::{Attached, Device};

/// One write to the part's register for markers: OCDR on the ATmega128 (I/O 0x22), GPIOR0 on the others (I/O
/// 0x1e).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Marker {
    /// Cycle at which the `out` began; it takes one.
    pub cycle: u64,
    pub value: u8,
}

/// The register: it keeps what is written to it.
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
