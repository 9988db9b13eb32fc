//! Task control blocks and priorities.

use core::ptr;

use crate::critical::{Masked, MaskedCell};
use crate::link::{Link, LinkCell};

/// A task's priority: [`P0`](Priority::P0) is the highest of eight.
///
/// A task runs until it blocks or a task of higher priority becomes ready. Tasks of one priority take
/// turns in the order in which they became ready, and only when the running one blocks or yields.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Priority {
    P0 = 0,
    P1 = 1,
    P2 = 2,
    P3 = 3,
    P4 = 4,
    P5 = 5,
    P6 = 6,
    P7 = 7,
}

impl Priority {
    pub(crate) const ALL: [Priority; LEVELS as usize] = {
        use Priority::*;
        [P0, P1, P2, P3, P4, P5, P6, P7]
    };
}

/// The number of priorities, and so of queues of ready tasks.
pub(crate) const LEVELS: u8 = 8;

/// What the kernel keeps of a task: 6 bytes on the AVR, and 4 more with the feature `cpu-time`.
///
/// ```text
///              start                       it is the highest
///   (unused) ─────────► ready ────────────────────────────────► running
///                         ▲ ▲       yields, is preempted           │
///                         │ └──────────────────────────────────────┤
///                         │ post, send, a timer                    │ wait, receive, delay
///                         └───────────── blocked ◄─────────────────┘
/// ```
///
/// A control block is in one list at a time, that of its link: a queue of ready tasks
/// ([`ready`](crate::ready)), or a wait queue ([`wait`](crate::wait)).
#[repr(C)]
pub struct ControlBlock {
    /// The queue that the task is in when it is ready: its priority, or the ceiling of a mutex that it holds.
    /// With [`HALTED`] set while the task may not become ready.
    pub(crate) level: MaskedCell<u8>,
    /// The saved stack pointer, in the port's form. 0 if there is no task, [`STARTING`] while one is started.
    pub(crate) stack_pointer: MaskedCell<usize>,
    /// The link to what follows this task in its list.
    pub(crate) link: LinkCell,
    /// The priority in the low three bits, and the flags of [`Flag`].
    pub(crate) priority: MaskedCell<u8>,
    /// The task's CPU time, in counts of the clock.
    #[cfg(feature = "cpu-time")]
    pub(crate) cpu_time: MaskedCell<u32>,
}

/// State of a task that other tasks check.
#[derive(Clone, Copy)]
#[repr(u8)]
pub(crate) enum Flag {
    /// It holds a mutex, or waits for one.
    Locks = 0x80,
    /// It starts or kills a task, and must not be killed meanwhile: the other task would stay half started or
    /// half killed.
    Unkillable = 0x40,
    /// It is a proxy waiter: its `stack_pointer` is the address of a [`WaitSet`](crate::wait_set::WaitSet).
    Proxy = 0x20,
    /// It was killed, or has killed itself.
    Killed = 0x10,
    /// It waits by proxy waiters or runs jobs. While it is blocked, its link leads to its wait set.
    Proxied = 0x08,
}

/// The priority in [`ControlBlock::priority`].
const PRIORITY: u8 = 7;

/// In [`ControlBlock::level`]: the task is suspended or was killed, or this is a proxy waiter. A level with
/// this bit outranks none.
pub(crate) const HALTED: u8 = 0x80;

/// [`ControlBlock::stack_pointer`] of a task that is being started: its stack is taken, and it has no context
/// yet.
const STARTING: usize = 1;

impl ControlBlock {
    /// The control block of a task that has not started.
    pub(crate) const fn new() -> Self {
        ControlBlock {
            level: MaskedCell::new(0),
            stack_pointer: MaskedCell::new(0),
            link: LinkCell::new(Link::NONE),
            priority: MaskedCell::new(0),
            #[cfg(feature = "cpu-time")]
            cpu_time: MaskedCell::new(0),
        }
    }

    /// The control block of the idle task, which every task preempts.
    pub(crate) const fn idle(context: usize) -> Self {
        let mut idle = ControlBlock::new();
        idle.stack_pointer = MaskedCell::new(context);
        idle
    }

    /// Whether both are the same task.
    #[inline(always)]
    pub(crate) fn is(&self, other: &ControlBlock) -> bool {
        ptr::eq(self, other)
    }

    /// The task behind this one, which is ready.
    #[inline(always)]
    pub(crate) fn next_ready(&self, masked: &Masked) -> &'static ControlBlock {
        // SAFETY: every caller takes the task from a ring, all of whose links lead to tasks.
        unsafe { self.link.get(masked).assume_task() }
    }

    /// The queue of ready tasks that this task belongs to: 0 to 7.
    #[inline(always)]
    pub(crate) fn queue(&self, masked: &Masked) -> u8 {
        self.level.get(masked) & PRIORITY
    }

    /// Whether this task goes before `other`, which is in the wait queue already.
    #[inline(always)]
    pub(crate) fn precedes(&self, masked: &Masked, other: &ControlBlock) -> bool {
        self.base(masked) < other.base(masked)
    }

    /// The priority's number, 0 to 7.
    #[inline(always)]
    pub(crate) fn base(&self, masked: &Masked) -> u8 {
        self.priority.get(masked) & PRIORITY
    }

    pub(crate) fn priority(&self, masked: &Masked) -> Priority {
        use Priority::*;
        // Not from a table: that would lie in RAM.
        match self.base(masked) {
            0 => P0,
            1 => P1,
            2 => P2,
            3 => P3,
            4 => P4,
            5 => P5,
            6 => P6,
            _ => P7,
        }
    }

    /// Changes the priority of a task that is in no queue of ready tasks. A halted task stays halted.
    pub(crate) fn set_priority(&self, masked: &Masked, priority: Priority) {
        self.priority.set(masked, self.priority.get(masked) & !PRIORITY | priority as u8);
        self.level.set(masked, self.level.get(masked) & HALTED | priority as u8);
    }

    #[inline(always)]
    pub(crate) fn set_flag(&self, masked: &Masked, flag: Flag) {
        self.priority.set(masked, self.priority.get(masked) | flag as u8);
    }

    #[inline(always)]
    pub(crate) fn clear_flag(&self, masked: &Masked, flag: Flag) {
        self.priority.set(masked, self.priority.get(masked) & !(flag as u8));
    }

    #[inline(always)]
    pub(crate) fn has_flag(&self, masked: &Masked, flag: Flag) -> bool {
        self.has_any(masked, flag as u8)
    }

    /// Whether one of these [`Flag`]s is set.
    #[inline(always)]
    pub(crate) fn has_any(&self, masked: &Masked, flags: u8) -> bool {
        self.priority.get(masked) & flags != 0
    }

    /// Whether the task may not become ready.
    #[inline(always)]
    pub(crate) fn is_halted(&self, masked: &Masked) -> bool {
        self.level.get(masked) & HALTED != 0
    }

    #[inline(always)]
    pub(crate) fn halt(&self, masked: &Masked) {
        self.level.set(masked, self.level.get(masked) | HALTED);
    }

    /// Claims the block for a task that is to start. Returns whether it was free.
    pub(crate) fn claim(&self, masked: &Masked) -> bool {
        let is_free = self.stack_pointer.get(masked) == 0;
        if is_free {
            self.stack_pointer.set(masked, STARTING);
        }
        is_free
    }

    /// Whether there is a task.
    #[inline(always)]
    pub(crate) fn is_started(&self, masked: &Masked) -> bool {
        self.stack_pointer.get(masked) > STARTING
    }

    /// Frees the block for another task. Nothing may refer to the old one any more.
    pub(crate) fn free(&self, masked: &Masked) {
        self.link.set(masked, Link::NONE);
        self.level.set(masked, 0);
        self.priority.set(masked, 0);
        self.stack_pointer.set(masked, 0);
    }
}

impl Link {
    /// To the next task.
    #[inline(always)]
    pub(crate) fn to(task: &'static ControlBlock) -> Link {
        Link::to_address(ptr::from_ref(task).cast())
    }

    /// The task, unless this is an end or a number of signals.
    #[inline(always)]
    pub(crate) fn task(self) -> Option<&'static ControlBlock> {
        if self.kind() > 0 {
            // SAFETY: neither an end nor a number.
            Some(unsafe { self.assume_task() })
        } else {
            None
        }
    }

    /// # Safety
    /// The link must be one to a task.
    #[inline(always)]
    pub(crate) unsafe fn assume_task(self) -> &'static ControlBlock {
        let task: *const ControlBlock = self.address().cast();
        // SAFETY: the caller guarantees that `to` made the link, from a static. So it is not null, and the
        // compiler need not check that.
        unsafe {
            core::hint::assert_unchecked(!task.is_null());
            &*task
        }
    }
}

impl LinkCell {
    /// The task, if it is one.
    #[inline(always)]
    pub(crate) fn task(&self, masked: &Masked) -> Option<&'static ControlBlock> {
        self.get(masked).task()
    }
}
