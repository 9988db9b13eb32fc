//! A module that has a body in a world.

use tasks::dock::{Dock, DockSet};
use tasks::message::Letter;
use tasks::router::Mcu;
use tasks::superbot::{MASTER_AXES, SLAVE_AXES};

use super::half::Half;
use crate::body::{Body, Drives};

/// A millisecond, in s.
const SECONDS: f64 = 1e-3;

pub struct Embodied {
    pub body: Body,
    master: Half<2, false>,
    slave: Half<1, true>,
}

impl Embodied {
    /// A module at power-up.
    pub fn new() -> Self {
        let mut body = Body::default();
        let master = Half::new(MASTER_AXES, &mut body);
        let slave = Half::new(SLAVE_AXES, &mut body);
        Embodied { body, master, slave }
    }

    /// Gives a message to the devices of an MCU.
    pub fn receive(&mut self, mcu: Mcu, letter: &Letter) {
        match mcu {
            Mcu::Master => self.master.receive(&mut self.body, letter),
            Mcu::Slave => self.slave.receive(&mut self.body, letter),
        }
    }

    /// Lets a millisecond begin, in which the master and the slave run or do not. Returns what the devices of
    /// each tell.
    pub fn step(&mut self, [master, slave]: [bool; 2]) -> [Vec<Letter>; 2] {
        let mut drives = Drives::default();
        let Embodied { body, .. } = self;
        let told = [
            if master { self.master.step(body, &mut drives) } else { Vec::new() },
            if slave { self.slave.step(body, &mut drives) } else { Vec::new() },
        ];
        body.step(&drives, SECONDS);
        told
    }

    /// Whether a dock is open, as its links see it.
    pub fn is_open(&self, dock: Dock) -> bool {
        let is_driven = self.master.drives_latch(dock) || self.slave.drives_latch(dock);
        self.body.end_switches(dock).is_open(is_driven)
    }

    /// The docks that send out light, to look for others.
    pub fn looking(&self) -> DockSet {
        self.master.looking().union(self.slave.looking())
    }

    /// The programs of the MCUs that are reset start over.
    pub fn reset(&mut self, is_reset: impl Fn(Mcu) -> bool) {
        if is_reset(Mcu::Master) {
            self.master.reset(&mut self.body);
        }
        if is_reset(Mcu::Slave) {
            self.slave.reset(&mut self.body);
        }
    }
}
