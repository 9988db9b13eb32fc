//! The programs and paths that are swept.

/// An image and its paths.
#[derive(Debug)]
pub struct Program {
    pub image: &'static str,
    /// The names of the paths, by their numbers.
    pub paths: &'static [&'static str],
    /// The numbers of the paths in which every pair of interrupts is tried, too. Pairs cost a thousand times
    /// as much as single interrupts, so these are short paths. Together they take every way through the
    /// kernel's assembly.
    pub in_pairs: &'static [u8],
}

pub const PROGRAMS: &[Program] = &[
    Program {
        image: "sweep_semaphore",
        paths: &[
            "post to nobody",
            "wait for a signal that is there",
            "post to a higher task, which then blocks",
            "post to a lower task, then block",
            "three wait at one semaphore",
            "post to a higher task, as interrupts do",
            "post to a lower task, as interrupts do",
            "wake two lower tasks",
            "event flags",
            "event flags that interrupts set too",
            "wait with a time limit",
            "post in a loop",
        ],
        in_pairs: &[0, 2, 3, 6],
    },
    Program {
        image: "sweep_queue",
        paths: &[
            "make and drop messages",
            "send to nobody, receive what is there",
            "send to a higher task, which then blocks",
            "send to a lower task, then block",
            "a full queue and an empty pool",
            "send to a higher task, as interrupts do",
            "send to a lower task, as interrupts do",
            "bytes that interrupts put too",
            "receive with a time limit",
            "send to a queue that interrupts fill",
            "put into a pipe and take from it",
            "put to a higher task that waits for bytes",
            "take from a higher task that waits for space",
            "a pipe that interrupts fill too",
        ],
        in_pairs: &[0, 2, 7],
    },
    Program {
        image: "sweep_timer",
        paths: &[
            "start, set anew, cancel",
            "timers that are due out of idleness",
            "delays",
            "cancel while a tick may come",
            "a delay that ends in a busy task",
            "a period",
            "three tasks woken at one tick",
            "a delay, another timer pending",
            "a delay, another timer due",
            "a period that is missed",
        ],
        in_pairs: &[3],
    },
    Program {
        image: "sweep_switch",
        paths: &[
            "the start of all tasks",
            "yield to nobody",
            "yield to an equal task",
            "preemption with all registers in use",
            "a mutex",
            "a mutex that holds a task up",
            "a mutex for which a higher task waits",
            "preemption of a preempting task",
            "block to a preempted task",
        ],
        in_pairs: &[1, 4],
    },
    Program {
        image: "sweep_control",
        paths: &[
            "suspend a task whose signal comes",
            "suspend a task that waits on",
            "suspend a delayed task",
            "suspend what is preempted or has arrived",
            "suspend itself",
            "suspend itself, resumed by an interrupt",
            "change its own priority",
            "change the priority of ready tasks",
            "change the priority of waiting tasks",
            "change what an interrupt resumes",
            "kill a waiting and a delayed task",
            "kill one of three that wait",
            "kill ready tasks",
            "exit and start anew",
            "kill what waits for several meanwhile",
            "exit after a delay",
        ],
        in_pairs: &[1],
    },
    Program {
        image: "sweep_several",
        paths: &[
            "a signal of one is there",
            "post one to a higher task",
            "a tick posts one",
            "a tick posts one and the other",
            "interrupts post one",
            "several wait for several",
            "jobs, and one that posts for another",
            "jobs that a higher task wakes",
            "jobs that an interrupt wakes",
        ],
        in_pairs: &[0],
    },
];
