//! Watches a pin as an oscilloscope does, with edges exact to the cycle.

use crate::cpu::Cpu;
use crate::device::{Attached, Device};
use crate::part::Pin;

/// A change of a pin's level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    pub cycle: u64,
    /// The level after it.
    pub level: bool,
}

/// A probe at a pin.
pub(crate) struct Probe {
    edges: Vec<Edge>,
    level: bool,
}

pub(crate) fn attach(cpu: Cpu, pin: Pin) -> Attached<Probe> {
    let level = cpu.is_high(pin);
    let probe = Attached::new(cpu, Probe { edges: Vec::new(), level }, &[], &[]);
    probe.watch_pin(cpu, pin.port, pin.bit);
    probe
}

impl Probe {
    /// The edges since they were last taken.
    pub fn take(&mut self) -> Vec<Edge> {
        std::mem::take(&mut self.edges)
    }
}

impl Device for Probe {
    fn write(&mut self, _cpu: Cpu, _address: u16, _value: u8) {}

    fn pin_changed(&mut self, cpu: Cpu, _bit: u8, level: bool) {
        if level != self.level {
            self.level = level;
            self.edges.push(Edge { cycle: cpu.cycle(), level });
        }
    }
}
