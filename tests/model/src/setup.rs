//! The objects of a run, and the calls before the kernel runs.

use std::array;

use kernel::Priority;

use crate::call::{Call, Group};
use crate::world::{Arrangement, MUTEXES, QUEUES, SEMAPHORES};

#[derive(Clone, Debug)]
pub struct Setup {
    /// A task for each priority.
    pub priorities: Vec<Priority>,
    /// How many of the tasks are started before the kernel runs.
    pub started: usize,
    /// A semaphore for each number, with so many signals in store.
    pub semaphores: Vec<u8>,
    /// A mutex for each ceiling.
    pub ceilings: Vec<Priority>,
    /// A queue for each number, with room for so many messages.
    pub rooms: Vec<u8>,
    pub timers: usize,
    /// A job for each semaphore in the list, which may be listed several times.
    pub jobs: Vec<usize>,
    /// Calls that are left out.
    pub without: Option<Group>,
    /// The calls after the tasks are started, before the kernel runs.
    pub boot: Vec<Call>,
}

impl Setup {
    /// The objects, including those that the setup does not use.
    pub fn arrangement(&self) -> Arrangement {
        let ceilings: [u8; MUTEXES] = padded(self.ceilings.iter().map(|&ceiling| ceiling as u8));
        Arrangement {
            priorities: padded(self.priorities.iter().map(|&priority| priority as u8)),
            started: self.started as u8,
            semaphores: padded::<SEMAPHORES>(self.semaphores.iter().copied()),
            ceilings,
            rooms: padded::<QUEUES>(self.rooms.iter().copied()),
            jobs: padded(self.jobs.iter().map(|&semaphore| semaphore as u8)),
        }
    }

    /// Whether this call may be made.
    pub fn has(&self, call: Call) -> bool {
        call.group().is_none_or(|group| self.without != Some(group))
    }

    /// A call for each value that an interrupt can read.
    pub fn all_observations(&self) -> Vec<Call> {
        let semaphores = (0..self.semaphores.len()).map(|semaphore| Call::TryWait { semaphore });
        let queues =
            (0..self.rooms.len()).flat_map(|queue| [Call::TryReceive { queue }, Call::Refused { queue }]);
        let tasks = (0..self.priorities.len()).map(|task| Call::Priority { task });
        let timers = (0..self.timers).map(|timer| Call::TimerIsRunning { timer });
        let others = [
            Call::TakeFlags(0xff),
            Call::FifoTake,
            Call::FifoOverruns,
            Call::PipeTryTake,
            Call::PipeOverruns,
            Call::PoolMostUsed,
            Call::PoolExhausted,
            Call::Now,
        ];
        let all = semaphores.chain(queues).chain(tasks).chain(timers).chain(others);
        all.filter(|&call| self.has(call)).collect()
    }
}

/// The first of `values`, and zeros behind them.
fn padded<const LENGTH: usize>(mut values: impl Iterator<Item = u8>) -> [u8; LENGTH] {
    array::from_fn(|_| values.next().unwrap_or(0))
}
