//! Where a message goes next.
//!
//! A module is two MCUs, each with docks and tasks of its own. Both run the same router over the
//! same [`Residence`]; a task or dock of the other MCU is reached over the bridge.

use crate::dock::{Dock, DockSet};
use crate::message::{Address, TaskCode};

/// One of the two MCUs of a module (paper, section 3).
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, PartialOrd, Ord, Hash))]
pub enum Mcu {
    Master,
    Slave,
}

impl Mcu {
    pub const ALL: [Mcu; 2] = [Mcu::Master, Mcu::Slave];
}

/// A set of tasks: one bit for each code.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct TaskSet([u8; 4]);

impl TaskSet {
    /// Every task there can be.
    pub const ALL: TaskSet = TaskSet([0xff; 4]);

    /// The set of the tasks listed.
    pub const fn of(mut tasks: &[TaskCode]) -> TaskSet {
        let mut bits = 0_u32;
        while let [first, rest @ ..] = tasks {
            bits |= 1 << first.code();
            tasks = rest;
        }
        TaskSet(bits.to_le_bytes())
    }

    pub fn contains(self, task: TaskCode) -> bool {
        // Byte by byte: the AVR shifts a 32-bit mask one bit at a time.
        let byte = self.0.get(usize::from(task.code() >> 3));
        byte.is_some_and(|byte| byte >> (task.code() & 7) & 1 != 0)
    }
}

/// The docks and tasks of one MCU.
#[derive(Clone, Copy)]
pub struct Residents {
    pub docks: DockSet,
    pub tasks: TaskSet,
}

/// Which dock and which task belongs to which MCU. A dock or task that belongs to neither is not in this
/// module.
#[derive(Clone, Copy)]
pub struct Residence {
    pub master: Residents,
    pub slave: Residents,
}

/// Where a message came from.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Source {
    /// A task of this MCU.
    Task,
    /// The neighbour beyond a dock of this MCU.
    Dock(Dock),
    /// The other MCU.
    Bridge,
}

/// Where a message goes.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
#[must_use]
pub enum Route {
    /// To a task of this MCU.
    Task(TaskCode),
    /// To the link at a dock of this MCU.
    Link(Dock),
    /// To the other MCU.
    Bridge,
    /// Nowhere: there is no such task or dock.
    Ignored,
    /// Nowhere: a neighbour may not send this.
    Refused,
}

/// The router of one MCU.
#[derive(Clone, Copy)]
pub struct Router {
    here: Residents,
    other: Residents,
}

impl Router {
    pub const fn new(mcu: Mcu, residence: Residence) -> Router {
        let Residence { master, slave } = residence;
        match mcu {
            Mcu::Master => Router { here: master, other: slave },
            Mcu::Slave => Router { here: slave, other: master },
        }
    }

    /// Decides by the address and the source alone. A neighbour reaches only behaviours of this module, and
    /// this module only those of a neighbour (paper, section 5). A message that came over the bridge does not
    /// go back over it.
    pub fn route(&self, to: Address, source: Source) -> Route {
        let task = to.task();
        let dock = to.dock();
        if matches!(source, Source::Dock(_)) && (dock.is_some() || !task.is_behaviour()) {
            return Route::Refused;
        }
        let has = |residents: &Residents| match dock {
            None => residents.tasks.contains(task),
            Some(dock) => task.is_behaviour() && residents.docks.contains(dock),
        };
        if has(&self.here) {
            dock.map_or(Route::Task(task), Route::Link)
        } else if source != Source::Bridge && has(&self.other) {
            Route::Bridge
        } else {
            Route::Ignored
        }
    }
}
