//! The three behaviour tasks (paper, Figure 5): thin loops around the pure parts of this crate.
//!
//! They see the module through [`tasks::api`] alone, run below all system tasks, and are the same in every module.

pub mod ac_receive;
pub mod ac_send;
pub mod hormone;
pub mod joints;

use kernel::{Mutex, Priority, Semaphore, Task, Timer};
use tasks::dock::Dock;

use crate::schedule::Schedule;
use crate::topology::Topology;

/// What AC_SEND and AC_RECV share: the topology, and when which dock is probed. Readers of RAM find at its start,
/// in two bytes, how many messages to AC_RECV were no probes.
#[repr(C)]
pub struct AdaptiveCommunication {
    state: Mutex<State>,
    /// Wakes AC_SEND.
    wake: Semaphore,
    timer: Timer,
}

#[repr(C)]
struct State {
    malformed: u16,
    topology: Topology,
    schedule: Schedule,
}

impl Default for AdaptiveCommunication {
    fn default() -> Self {
        Self::new()
    }
}

impl AdaptiveCommunication {
    /// A module that has heard nothing.
    pub const fn new() -> Self {
        AdaptiveCommunication {
            state: Mutex::new(
                Priority::P5,
                State { malformed: 0, topology: Topology::new(), schedule: Schedule::new(0) },
            ),
            wake: Semaphore::new(0),
            timer: Timer::new(),
        }
    }

    fn with<R>(&self, task: &mut Task, work: impl FnOnce(&mut State) -> R) -> R {
        self.state.with(task, work)
    }

    /// Has `dock` probed at once.
    fn hurry(&self, task: &mut Task, dock: Dock) {
        self.with(task, |state| state.schedule.hurry(dock));
        self.wake.post(task);
    }

    /// Has docks with a lossy link probed quickly, and no others.
    fn quicken(&self, task: &mut Task, time: u16) {
        let is_more = self.with(task, |state| {
            let lossy = state.topology.lossy(time);
            state.schedule.set_quick(lossy, time)
        });
        if is_more {
            self.wake.post(task);
        }
    }
}
