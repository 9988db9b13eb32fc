//! Which MCU of a module has which docks, and which runs which task: the one place that says so. Images,
//! simulators and tests read it.
//!
//! To move a task to the other MCU, move its line here, and start it in the `main.rs` of that MCU.

use crate::dock::{Dock, DockSet};
use crate::message::TaskCode;
use crate::motor::Axis;
use crate::router::{Residence, Residents, TaskSet};

/// The docks and tasks of a SuperBot module (paper, section 3).
pub const RESIDENCE: Residence = Residence {
    master: Residents {
        docks: DockSet::of(&[Dock::Front, Dock::Left, Dock::Right]),
        tasks: TaskSet::of(&[
            TaskCode::AC_RECEIVE,
            TaskCode::HORMONE,
            TaskCode::joint(Axis::Front),
            TaskCode::joint(Axis::Roll),
            TaskCode::dock(Dock::Front),
            TaskCode::dock(Dock::Left),
            TaskCode::dock(Dock::Right),
            TaskCode::POWER_BEYOND,
            TaskCode::ACCELEROMETER,
            TaskCode::MASTER_TEMPERATURE,
            TaskCode::MASTER_INSPECTOR,
        ]),
    },
    slave: Residents {
        docks: DockSet::of(&[Dock::Back, Dock::Up, Dock::Down]),
        tasks: TaskSet::of(&[
            TaskCode::CONSOLE,
            TaskCode::joint(Axis::Back),
            TaskCode::dock(Dock::Back),
            TaskCode::dock(Dock::Up),
            TaskCode::dock(Dock::Down),
            TaskCode::POWER,
            TaskCode::SLAVE_TEMPERATURE,
            TaskCode::SLAVE_INSPECTOR,
        ]),
    },
};
