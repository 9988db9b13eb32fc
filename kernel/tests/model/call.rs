//! What tasks and interrupts do, as values: the kernel and the reference both act on them.

use kernel::{Priority, Refused, TaskState, Ticks};

/// The objects of a run.
#[derive(Clone, Debug)]
pub struct Setup {
    /// A task for each.
    pub priorities: Vec<Priority>,
    /// So many of them are started before the kernel runs.
    pub started: usize,
    /// A semaphore for each, with so many signals in store.
    pub semaphores: Vec<u8>,
    /// A mutex for each, with this ceiling.
    pub ceilings: Vec<Priority>,
    /// A queue for each, with so much room.
    pub rooms: Vec<u8>,
    pub timers: usize,
}

/// Messages in the pool, for all queues together.
pub const BUFFERS: usize = 5;

/// Space in the FIFO, in bytes.
pub const FIFO_BYTES: usize = 3;

/// A kernel call; the objects by their index in the setup.
#[derive(Clone, Copy, Debug, PartialEq)]
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
        priority: Priority,
    },
    State {
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
    Lock {
        mutex: usize,
    },
    Unlock,
    SetFlags(u8),
    TakeFlags(u8),
    WaitAny(u8),
    WaitAll(u8),
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
    Put(u8),
    Take,
    Overruns,
    Now,
    StartTimer {
        timer: usize,
        ticks: Ticks,
        semaphore: usize,
    },
    CancelTimer {
        timer: usize,
    },
    Yield,
    Delay(Ticks),
    DelayUntil(Ticks),
    StartPeriod(Ticks),
    /// Returns how many deadlines were missed so far.
    WaitForPeriod,
}

/// What tasks wait for in line.
#[derive(Clone, Copy, PartialEq)]
pub enum Object {
    Semaphore(usize),
    Mutex(usize),
    Queue(usize),
    Flags,
}

impl Call {
    /// What it waits for, if need be, in line with others.
    pub fn awaits(self) -> Option<Object> {
        match self {
            Call::Wait { semaphore } | Call::WaitTimeout { semaphore, .. } => {
                Some(Object::Semaphore(semaphore))
            }
            Call::Lock { mutex } => Some(Object::Mutex(mutex)),
            Call::Receive { queue } | Call::ReceiveTimeout { queue, .. } => Some(Object::Queue(queue)),
            Call::WaitAny(_) | Call::WaitAll(_) => Some(Object::Flags),
            _ => None,
        }
    }
}

/// What a call returns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    Nothing,
    Truth(bool),
    Number(u16),
    Byte(Option<u8>),
    Elapsed,
    Full,
    Exhausted,
    Refused(Refused),
    State(TaskState),
}

/// What an interrupt does.
#[derive(Clone, Debug, PartialEq)]
pub enum Handler {
    Calls(Vec<Call>),
    /// A tick of the clock, and what strikes inside of it.
    Tick(Option<Box<Strike>>),
}

/// An interrupt that comes inside of a task's call or of a tick, at the end of a masked section.
#[derive(Clone, Debug, PartialEq)]
pub struct Strike {
    /// So many sections from the beginning, or from the strike before.
    pub sections: usize,
    pub handler: Handler,
    pub then: Option<Box<Strike>>,
}

/// What happens next, between two calls of the running task or while none runs.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// The running task calls.
    Call(Call, Option<Strike>),
    /// An interrupt comes.
    Interrupt(Handler),
    /// While no task runs: so many ticks, or until one does.
    Silence(u16),
}
