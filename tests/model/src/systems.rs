//! Small systems of three tasks. Every sequence of their calls is played.

use kernel::Priority;

use crate::call::Call;
use crate::setup::Setup;

/// A system, and the calls and interrupts that can happen in it.
pub struct System {
    pub setup: Setup,
    pub calls: &'static [Call],
    /// The calls of interrupts; each handler makes one of them.
    pub of_interrupts: &'static [Call],
    /// Whether there are ticks.
    pub ticks: bool,
    /// Whether tasks may end, or may wait for ever. Then each sequence has a kernel of its own.
    pub is_left: bool,
}

/// Two semaphores, a mutex and a queue with room for one.
pub fn messages(priorities: [Priority; 3], ceiling: Priority) -> System {
    System {
        setup: setup(priorities, ceiling),
        calls: &[
            Call::Wait { semaphore: 0 },
            Call::Wait { semaphore: 1 },
            Call::WaitTimeout { semaphore: 0, ticks: 1 },
            Call::Post { semaphore: 0 },
            Call::Post { semaphore: 1 },
            Call::Lock { mutex: 0 },
            Call::Unlock,
            Call::Make { value: 1 },
            Call::SendMade { queue: 0 },
            Call::Receive { queue: 0 },
            Call::ReceiveTimeout { queue: 0, ticks: 1 },
            Call::Yield,
            Call::Delay(1),
            Call::Send { queue: 0, value: 1 },
        ],
        of_interrupts: &[
            Call::Post { semaphore: 0 },
            Call::Post { semaphore: 1 },
            Call::Send { queue: 0, value: 2 },
        ],
        ticks: true,
        is_left: false,
    }
}

/// Waits for several semaphores, of which one is listed twice.
pub fn several(priorities: [Priority; 3], ceiling: Priority) -> System {
    System {
        setup: setup(priorities, ceiling),
        calls: &[
            Call::WaitForSeveral { semaphores: [0, 1, 0] },
            Call::Wait { semaphore: 0 },
            Call::TryWait { semaphore: 1 },
            Call::Post { semaphore: 0 },
            Call::Post { semaphore: 1 },
            Call::Suspend { task: 0 },
            Call::Resume { task: 0 },
            Call::Yield,
        ],
        of_interrupts: &[Call::Post { semaphore: 0 }, Call::Post { semaphore: 1 }, Call::Resume { task: 0 }],
        ticks: false,
        is_left: false,
    }
}

/// Waits with a timeout, of all kinds.
pub fn timeouts(priorities: [Priority; 3], ceiling: Priority) -> System {
    System {
        setup: setup(priorities, ceiling),
        calls: &[
            Call::WaitForSeveralTimeout { semaphores: [0, 1, 0], ticks: 1 },
            Call::WaitAnyTimeout { flags: 3, ticks: 1 },
            Call::WaitAllTimeout { flags: 3, ticks: 2 },
            Call::LockTimeout { mutex: 0, ticks: 1 },
            Call::TryLock { mutex: 0 },
            Call::Unlock,
            Call::SetFlags(1),
            Call::Post { semaphore: 0 },
            Call::Kill { task: 0 },
            Call::Yield,
        ],
        of_interrupts: &[Call::SetFlags(2), Call::Post { semaphore: 0 }],
        ticks: true,
        is_left: true,
    }
}

/// A pipe with space for two bytes.
pub fn pipe(priorities: [Priority; 3], ceiling: Priority) -> System {
    System {
        setup: setup(priorities, ceiling),
        calls: &[
            Call::PipePut(1),
            Call::PipePutTimeout { byte: 2, ticks: 1 },
            Call::PipeTake,
            Call::PipeTakeTimeout { ticks: 1 },
            Call::PipeTryPut(3),
            Call::PipeTryTake,
            Call::PipeFlush,
            Call::Yield,
        ],
        of_interrupts: &[Call::PipeTryPut(4), Call::PipeTryTake],
        ticks: true,
        is_left: false,
    }
}

/// Three jobs, two of them for signals of one semaphore.
pub fn jobs(priorities: [Priority; 3], ceiling: Priority) -> System {
    System {
        setup: Setup { jobs: vec![0, 1, 0], ..setup(priorities, ceiling) },
        calls: &[
            Call::RunJobs { jobs: [0, 1] },
            Call::RunJobs { jobs: [2, 0] },
            Call::EndJob,
            Call::Wait { semaphore: 1 },
            Call::Post { semaphore: 0 },
            Call::Post { semaphore: 1 },
            Call::Suspend { task: 0 },
            Call::Resume { task: 0 },
            Call::Kill { task: 0 },
            Call::Yield,
        ],
        of_interrupts: &[Call::Post { semaphore: 0 }, Call::Post { semaphore: 1 }],
        ticks: false,
        is_left: true,
    }
}

/// Tasks that suspend, resume, kill and start each other and themselves, and change priorities.
pub fn control(priorities: [Priority; 3], ceiling: Priority) -> System {
    System {
        setup: setup(priorities, ceiling),
        calls: &[
            Call::Wait { semaphore: 0 },
            Call::Post { semaphore: 0 },
            Call::Lock { mutex: 0 },
            Call::Unlock,
            Call::Suspend { task: 0 },
            Call::Suspend { task: 1 },
            Call::Resume { task: 0 },
            Call::Resume { task: 1 },
            Call::SetPriority { task: 0, priority: Priority::P2 },
            Call::SetPriority { task: 1, priority: Priority::P4 },
            Call::Kill { task: 0 },
            Call::Kill { task: 1 },
            Call::Start { task: 0 },
            Call::Exit,
            Call::Yield,
        ],
        of_interrupts: &[Call::Post { semaphore: 0 }, Call::Resume { task: 0 }, Call::Start { task: 0 }],
        ticks: false,
        is_left: true,
    }
}

fn setup(priorities: [Priority; 3], ceiling: Priority) -> Setup {
    Setup {
        priorities: priorities.to_vec(),
        started: priorities.len(),
        semaphores: vec![0, 0],
        ceilings: vec![ceiling],
        rooms: vec![1],
        timers: 0,
        jobs: Vec::new(),
        without: None,
        boot: Vec::new(),
    }
}
