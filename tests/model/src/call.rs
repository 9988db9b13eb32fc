//! The calls of tasks and interrupts, as values. The kernel and the reference both act on them.

use kernel::{Elapsed, Priority, Refused, TaskState, Ticks};
use serde::{Deserialize, Serialize};

use crate::wire::{WirePriority, WireRefused, WireTaskState};

/// How many semaphores a task waits for at once.
pub const SEVERAL: usize = 3;

/// How many jobs a task runs.
pub const JOBS: usize = 2;

/// Messages in the pool, for all queues together.
pub const BUFFERS: usize = 5;

/// Space in the FIFO, in bytes.
pub const FIFO_BYTES: usize = 3;

/// Space in the pipe, in bytes.
pub const PIPE_BYTES: usize = 2;

/// A kernel call. Objects are named by their index in the setup.
#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Call {
    /// Starts a task. Returns whether it was not started before.
    Start {
        task: usize,
    },
    Suspend {
        task: usize,
    },
    /// Returns whether it was suspended.
    Resume {
        task: usize,
    },
    SetPriority {
        task: usize,
        #[serde(with = "WirePriority")]
        priority: Priority,
    },
    State {
        task: usize,
    },
    Priority {
        task: usize,
    },
    Kill {
        task: usize,
    },
    /// Never returns.
    Exit,
    Post {
        semaphore: usize,
    },
    TryWait {
        semaphore: usize,
    },
    Wait {
        semaphore: usize,
    },
    WaitTimeout {
        semaphore: usize,
        ticks: Ticks,
    },
    /// Takes a signal of one of these semaphores; the same one may be listed twice.
    WaitForSeveral {
        semaphores: [usize; SEVERAL],
    },
    WaitForSeveralTimeout {
        semaphores: [usize; SEVERAL],
        ticks: Ticks,
    },
    /// Returns, as [`EndJob`](Call::EndJob) does, the job that begins.
    RunJobs {
        jobs: [usize; JOBS],
    },
    /// The end of the job that the task is in.
    EndJob,
    Lock {
        mutex: usize,
    },
    TryLock {
        mutex: usize,
    },
    LockTimeout {
        mutex: usize,
        ticks: Ticks,
    },
    Unlock,
    SetFlags(u8),
    TakeFlags(u8),
    WaitAny(u8),
    WaitAll(u8),
    WaitAnyTimeout {
        flags: u8,
        ticks: Ticks,
    },
    WaitAllTimeout {
        flags: u8,
        ticks: Ticks,
    },
    /// Makes a message and sends it; drops it if the queue is full.
    Send {
        queue: usize,
        value: u8,
    },
    /// Makes a message, for the task to keep.
    Make {
        value: u8,
    },
    /// Sends that message; the task keeps it if the queue is full.
    SendMade {
        queue: usize,
    },
    TryReceive {
        queue: usize,
    },
    Receive {
        queue: usize,
    },
    ReceiveTimeout {
        queue: usize,
        ticks: Ticks,
    },
    /// Drops the messages that the task has.
    DropMessages,
    Refused {
        queue: usize,
    },
    PoolExhausted,
    PoolMostUsed,
    FifoPut(u8),
    FifoTake,
    FifoPeek,
    FifoLength,
    FifoSpace,
    FifoFlush,
    FifoOverruns,
    PipePut(u8),
    PipePutTimeout {
        byte: u8,
        ticks: Ticks,
    },
    PipeTake,
    PipeTakeTimeout {
        ticks: Ticks,
    },
    PipeTryPut(u8),
    PipeTryTake,
    PipePeek,
    PipeLength,
    PipeSpace,
    PipeFlush,
    PipeOverruns,
    Now,
    StartTimer {
        timer: usize,
        ticks: Ticks,
        semaphore: usize,
    },
    CancelTimer {
        timer: usize,
    },
    TimerIsRunning {
        timer: usize,
    },
    Yield,
    Delay(Ticks),
    DelayUntil(Ticks),
    StartPeriod(Ticks),
    /// Returns how many deadlines were missed so far.
    WaitForPeriod,
}

/// An object with a queue of waiting tasks.
#[derive(Clone, Copy, PartialEq)]
pub enum Object {
    Semaphore(usize),
    Mutex(usize),
    Queue(usize),
    Flags,
    /// A byte in the pipe.
    Byte,
    /// Space in the pipe.
    Space,
}

/// Groups of calls that an image can leave out where the flash is small, by a feature for each group.
#[derive(Clone, Copy, PartialEq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Group {
    /// Calls of FIFOs and pipes, and all calls before the kernel runs.
    Bytes,
    /// Waits for one of several semaphores, jobs, and event flags.
    Several,
}

impl Call {
    /// The group that the call belongs to.
    pub fn group(self) -> Option<Group> {
        match self {
            Call::FifoPut(_)
            | Call::FifoTake
            | Call::FifoPeek
            | Call::FifoLength
            | Call::FifoSpace
            | Call::FifoFlush
            | Call::FifoOverruns
            | Call::PipePut(_)
            | Call::PipePutTimeout { .. }
            | Call::PipeTake
            | Call::PipeTakeTimeout { .. }
            | Call::PipeTryPut(_)
            | Call::PipeTryTake
            | Call::PipePeek
            | Call::PipeLength
            | Call::PipeSpace
            | Call::PipeFlush
            | Call::PipeOverruns => Some(Group::Bytes),
            Call::WaitForSeveral { .. }
            | Call::WaitForSeveralTimeout { .. }
            | Call::RunJobs { .. }
            | Call::EndJob
            | Call::SetFlags(_)
            | Call::TakeFlags(_)
            | Call::WaitAny(_)
            | Call::WaitAll(_)
            | Call::WaitAnyTimeout { .. }
            | Call::WaitAllTimeout { .. } => Some(Group::Several),
            _ => None,
        }
    }

    /// The object that the call may wait for, in line with other tasks.
    pub fn awaits(self) -> Option<Object> {
        match self {
            Call::Wait { semaphore } | Call::WaitTimeout { semaphore, .. } => {
                Some(Object::Semaphore(semaphore))
            }
            Call::Lock { mutex } | Call::LockTimeout { mutex, .. } => Some(Object::Mutex(mutex)),
            Call::Receive { queue } | Call::ReceiveTimeout { queue, .. } => Some(Object::Queue(queue)),
            Call::WaitAny(_)
            | Call::WaitAll(_)
            | Call::WaitAnyTimeout { .. }
            | Call::WaitAllTimeout { .. } => Some(Object::Flags),
            Call::PipePut(_) | Call::PipePutTimeout { .. } => Some(Object::Space),
            Call::PipeTake | Call::PipeTakeTimeout { .. } => Some(Object::Byte),
            _ => None,
        }
    }

    /// The ticks of a wait for one thing with a timeout.
    pub fn timeout(self) -> Option<Ticks> {
        match self {
            Call::WaitTimeout { ticks, .. }
            | Call::LockTimeout { ticks, .. }
            | Call::WaitAnyTimeout { ticks, .. }
            | Call::WaitAllTimeout { ticks, .. }
            | Call::ReceiveTimeout { ticks, .. }
            | Call::PipePutTimeout { ticks, .. }
            | Call::PipeTakeTimeout { ticks } => Some(ticks),
            _ => None,
        }
    }

    /// The semaphores of a wait for several.
    pub fn several(self) -> Option<[usize; SEVERAL]> {
        match self {
            Call::WaitForSeveral { semaphores } | Call::WaitForSeveralTimeout { semaphores, .. } => {
                Some(semaphores)
            }
            _ => None,
        }
    }

    /// Whether the call takes a mutex, if it succeeds.
    pub fn locks(self) -> bool {
        matches!(self, Call::Lock { .. } | Call::TryLock { .. } | Call::LockTimeout { .. })
    }

    /// Whether only a task can make the call, but no job.
    pub fn needs_task(self) -> bool {
        self.awaits().is_some()
            || matches!(
                self,
                Call::WaitForSeveral { .. }
                    | Call::WaitForSeveralTimeout { .. }
                    | Call::TryLock { .. }
                    | Call::RunJobs { .. }
                    | Call::Exit
                    | Call::Yield
                    | Call::Delay(_)
                    | Call::DelayUntil(_)
                    | Call::StartPeriod(_)
                    | Call::WaitForPeriod
            )
    }
}

/// What a call returns.
#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Outcome {
    Nothing,
    Truth(bool),
    Number(u16),
    Byte(Option<u8>),
    Elapsed,
    Full,
    Exhausted,
    Refused(#[serde(with = "WireRefused")] Refused),
    State(#[serde(with = "WireTaskState")] TaskState),
    Priority(#[serde(with = "WirePriority")] Priority),
    JobTaken,
}

impl From<()> for Outcome {
    fn from(_: ()) -> Self {
        Outcome::Nothing
    }
}

impl From<bool> for Outcome {
    fn from(truth: bool) -> Self {
        Outcome::Truth(truth)
    }
}

impl From<u8> for Outcome {
    fn from(number: u8) -> Self {
        Outcome::Number(number.into())
    }
}

impl From<u16> for Outcome {
    fn from(number: u16) -> Self {
        Outcome::Number(number)
    }
}

impl From<Option<u8>> for Outcome {
    fn from(byte: Option<u8>) -> Self {
        Outcome::Byte(byte)
    }
}

impl From<Result<(), Elapsed>> for Outcome {
    fn from(result: Result<(), Elapsed>) -> Self {
        result.map_or(Outcome::Elapsed, Outcome::from)
    }
}

impl From<Result<u8, Elapsed>> for Outcome {
    fn from(result: Result<u8, Elapsed>) -> Self {
        result.map_or(Outcome::Elapsed, Outcome::from)
    }
}

impl From<Result<(), Refused>> for Outcome {
    fn from(result: Result<(), Refused>) -> Self {
        result.map_or_else(Outcome::Refused, Outcome::from)
    }
}
