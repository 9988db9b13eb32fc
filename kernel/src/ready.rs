//! The ready tasks: a queue for each priority, and the head, which is the task that should run.
//!
//! Each queue is a ring. The kernel keeps its last task, whose link leads to the first. The running task is
//! the first of its queue, and so is every task that was preempted. The head is the first task of the highest
//! queue that is not empty; all code that changes a queue updates it. The idle task is in no queue; it is the
//! head when all queues are empty.
//!
//! `head` is the task that should run, `running` the one that does. If they differ a switch is due: a task
//! makes it at once, an ISR at its end. If an ISR makes the switch before the task does, the task's own
//! switch has no effect, and does no harm. So the queues change in short critical sections, and the switch
//! follows.
//!
//! A task that blocks leaves its queue in one critical section ([`leave`]) and finds the next head in another
//! ([`dispatch`]). In between it is still the head, so an ISR returns to it, unless the ISR wakes a task that
//! outranks it.

use core::hint;

use crate::arch;
use crate::context::{Context, Task};
use crate::control_block::{ControlBlock, Flag, LEVELS};
use crate::critical::{Masked, MaskedCell};
use crate::link::{Link, LinkCell};
use crate::traversal;
use crate::{IDLE, KERNEL};

/// The state of the scheduler. `repr(C)`: the context switch reads its first two fields.
#[repr(C)]
pub(crate) struct ReadyQueue {
    /// The task that should run.
    pub(crate) head: MaskedCell<&'static ControlBlock>,
    /// The task whose registers are in the CPU.
    pub(crate) running: MaskedCell<&'static ControlBlock>,
    /// The head's queue; [`LEVELS`] if the head is the idle task.
    level: MaskedCell<u8>,
    /// The last task of each queue.
    last: [Last; LEVELS as usize],
}

/// The last task of a ring, or [`Link::NONE`].
pub(crate) type Last = LinkCell;

impl ReadyQueue {
    pub(crate) const fn new(idle: &'static ControlBlock) -> Self {
        ReadyQueue {
            head: MaskedCell::new(idle),
            running: MaskedCell::new(idle),
            level: MaskedCell::new(LEVELS),
            last: [const { Last::new(Link::NONE) }; LEVELS as usize],
        }
    }

    /// Restores the initial state, with only the idle task. Tasks that were ready are parked.
    #[allow(dead_code, reason = "a port for tests starts the kernel again and again")]
    pub(crate) fn reset(&self, masked: &Masked) {
        self.head.set(masked, &IDLE);
        self.running.set(masked, &IDLE);
        self.level.set(masked, LEVELS);
        for last in &self.last {
            while let Some(task) = dequeue(masked, last) {
                task.link.set(masked, Link::PARKED);
            }
        }
    }

    /// The highest queue that is not empty, and its first task. One comparison per queue: 4 cycles, where a
    /// loop takes 12.
    #[inline(always)]
    fn highest(&self, masked: &Masked) -> (u8, &'static ControlBlock) {
        let [q0, q1, q2, q3, q4, q5, q6, q7] = &self.last;
        // SAFETY: called only for a queue that is not empty.
        let first = |last: &Last| unsafe { last.get(masked).assume_task() }.next_ready(masked);
        match () {
            () if q0.kind(masked) != 0 => (0, first(q0)),
            () if q1.kind(masked) != 0 => (1, first(q1)),
            () if q2.kind(masked) != 0 => (2, first(q2)),
            () if q3.kind(masked) != 0 => (3, first(q3)),
            () if q4.kind(masked) != 0 => (4, first(q4)),
            () if q5.kind(masked) != 0 => (5, first(q5)),
            () if q6.kind(masked) != 0 => (6, first(q6)),
            () if q7.kind(masked) != 0 => (7, first(q7)),
            () => (LEVELS, &IDLE),
        }
    }

    /// The last task of the queue `level`; only the low three bits of `level` count.
    #[inline(always)]
    fn last(&self, level: u8) -> &Last {
        &self.last[(level & (LEVELS - 1)) as usize]
    }
}

/// The running task.
#[inline(always)]
pub(crate) fn running(masked: &Masked) -> &'static ControlBlock {
    KERNEL.ready.running.get(masked)
}

/// [`running`] without a critical section: the calling task is the running one, whatever interrupts do. 4
/// cycles.
#[inline(always)]
pub(crate) fn current(_: &mut Task) -> &'static ControlBlock {
    // SAFETY: if this is preempted between the two bytes, both are those of the task again when it continues.
    running(&unsafe { Masked::assume() })
}

/// Whether the head is another task than the running one.
pub(crate) fn is_due(masked: &Masked) -> bool {
    !KERNEL.ready.head.get(masked).is(running(masked))
}

/// Whether `task` is ready, and the first of its queue.
pub(crate) fn is_first(masked: &Masked, task: &ControlBlock) -> bool {
    let last = KERNEL.ready.last(task.level.get(masked)).task(masked);
    last.is_some_and(|last| last.next_ready(masked).is(task))
}

/// Makes `task`, which is in no list, ready. Returns whether it is the head now.
#[inline(never)]
pub(crate) fn wake(masked: &Masked, task: &'static ControlBlock) -> bool {
    let outranks = preempt(masked, task);
    if !outranks {
        append(masked, task);
    }
    outranks
}

/// Makes `task`, which is in no list, ready if it outranks the head. Returns whether it does, and so is the
/// head now.
#[inline(always)]
pub(crate) fn preempt(masked: &Masked, task: &'static ControlBlock) -> bool {
    let ready = &KERNEL.ready;
    let level = task.level.get(masked);
    let outranks = level < ready.level.get(masked);
    if outranks {
        // SAFETY: `ready.level` is at most `LEVELS`, and the level is below.
        unsafe { assume_not_halted(level) };
        // Its queue is empty: otherwise the head would be from that queue.
        ready.last(level).set(masked, Link::to(task));
        task.link.set(masked, Link::to(task));
        ready.level.set(masked, level);
        ready.head.set(masked, task);
    }
    outranks
}

/// Puts `task` behind the tasks of its queue, or parks it if it is halted. Returns `false` if it was killed.
#[inline(never)]
pub(crate) fn append(masked: &Masked, task: &'static ControlBlock) -> bool {
    if task.is_halted(masked) {
        task.link.set(masked, Link::PARKED);
        return !task.has_flag(masked, Flag::Killed);
    }
    let cell = KERNEL.ready.last(task.level.get(masked));
    enqueue(masked, cell, task);
    true
}

/// Puts `task` behind the tasks of a ring.
#[inline(always)]
pub(crate) fn enqueue(masked: &Masked, cell: &Last, task: &'static ControlBlock) {
    enqueue_first(masked, cell, task);
    cell.set(masked, Link::to(task)); // the first of a ring is behind its last
}

/// Puts `task` before the tasks of a ring.
#[inline(always)]
fn enqueue_first(masked: &Masked, cell: &Last, task: &'static ControlBlock) {
    let first = match cell.task(masked) {
        Some(last) => last.link.replace(masked, Link::to(task)),
        None => {
            cell.set(masked, Link::to(task));
            Link::to(task)
        }
    };
    task.link.set(masked, first);
}

/// Takes the first task from a ring.
#[inline(always)]
pub(crate) fn dequeue(masked: &Masked, cell: &Last) -> Option<&'static ControlBlock> {
    let last = cell.task(masked)?;
    let first = last.next_ready(masked);
    remove_behind(masked, cell, last, first);
    Some(first)
}

/// Takes `task` from a ring, where it stands behind `before`.
#[inline(always)]
fn remove_behind(masked: &Masked, cell: &Last, before: &'static ControlBlock, task: &'static ControlBlock) {
    if before.is(task) {
        cell.set(masked, Link::NONE);
        return;
    }
    before.link.set(masked, task.link.get(masked));
    if cell.get(masked) == Link::to(task) {
        cell.set(masked, Link::to(before));
    }
}

/// Tells the compiler that a level is the number of a queue, so that it need not mask the low bits.
///
/// # Safety
/// `level` must be below [`LEVELS`].
#[inline(always)]
unsafe fn assume_not_halted(level: u8) {
    // SAFETY: the caller guarantees it.
    unsafe { hint::assert_unchecked(level < LEVELS) };
}

/// Takes the running task from its queue, and returns it. The caller sets its link; [`dispatch`] must follow.
#[inline(always)]
pub(crate) fn leave(masked: &Masked) -> &'static ControlBlock {
    arch::may_block();
    let task = running(masked);
    // SAFETY: a task that runs is not halted.
    unsafe { assume_not_halted(task.level.get(masked)) };
    leave_first(masked, task);
    traversal::end(masked);
    task
}

/// Takes `task` from its queue, where it is the first.
#[inline(always)]
fn leave_first(masked: &Masked, task: &'static ControlBlock) {
    let cell = KERNEL.ready.last(task.level.get(masked));
    let last = cell.get(masked);
    if last == Link::to(task) {
        cell.set(masked, Link::NONE);
    } else {
        // SAFETY: `task` is in this queue, so the queue has a last task.
        unsafe { last.assume_task() }.link.set(masked, task.link.get(masked));
    }
}

/// Finds the head again, after it may have left its queue.
#[inline(never)]
pub(crate) fn update_head(masked: &Masked) {
    update_head_here(masked);
}

#[inline(always)]
fn update_head_here(masked: &Masked) {
    let ready = &KERNEL.ready;
    let (level, head) = ready.highest(masked);
    ready.level.set(masked, level);
    ready.head.set(masked, head);
}

/// Finds the next head after the running task has [left](leave) its queue, in a critical section of its own.
/// Returns `true`: a switch is due.
#[inline(never)]
pub(crate) fn dispatch(task: &mut Task) -> bool {
    task.mask(update_head_here);
    true
}

/// Blocks the running task unless `is_over`, which is evaluated in the same critical section. The task is in
/// no list then, and its link is `link`. Returns whether it has blocked: a switch is due then.
#[inline(always)]
pub(crate) fn block_unless(task: &mut Task, link: Link, is_over: impl FnOnce(&Masked) -> bool) -> bool {
    let blocks = task.mask(|masked| {
        let blocks = !is_over(masked);
        if blocks {
            leave(masked).link.set(masked, link);
        }
        blocks
    });
    blocks && dispatch(task)
}

/// Puts the running task behind the others of its queue. Returns whether there are any: a switch is due then.
pub(crate) fn rotate(masked: &Masked) -> bool {
    let ready = &KERNEL.ready;
    let task = running(masked);
    // As the queue is a ring, the first becomes the last.
    ready.last(task.level.get(masked)).set(masked, Link::to(task));
    let next = task.next_ready(masked);
    ready.head.set(masked, next);
    traversal::end(masked);
    !next.is(task)
}

/// Moves the running task to the queue of `ceiling`, if that is above its own, until [`restore`].
#[inline(always)]
pub(crate) fn raise(masked: &Masked, ceiling: u8) {
    let ready = &KERNEL.ready;
    let task = running(masked);
    task.set_flag(masked, Flag::Locks);
    if ceiling < task.level.get(masked) {
        leave_first(masked, task);
        // That queue is empty, as the running task is the highest, and below it.
        task.link.set(masked, Link::to(task));
        ready.last(ceiling).set(masked, Link::to(task));
        task.level.set(masked, ceiling);
        ready.level.set(masked, ceiling);
        traversal::end(masked);
    }
}

/// Undoes [`raise`]: the running task is first in the queue of its priority again. Returns whether a switch
/// is due.
pub(crate) fn restore(task: &mut Task) -> bool {
    let was_raised = task.mask(|masked| {
        let task = running(masked);
        task.clear_flag(masked, Flag::Locks);
        let base = task.base(masked);
        let was_raised = base != task.level.get(masked);
        if was_raised {
            leave_first(masked, task);
            enqueue_first(masked, KERNEL.ready.last(base), task);
            task.level.set(masked, base);
            traversal::end(masked);
        }
        was_raised
    });
    // As between `leave` and `dispatch`, this task is still the head, unless an ISR wakes one that outranks
    // the ceiling.
    arch::irq_window();
    task.mask(|masked| {
        if was_raised {
            update_head(masked);
        }
        is_due(masked)
    })
}

/// The position of a search for a ready task.
pub(crate) struct Cursor {
    /// The task that the search has come to; none before it begins.
    before: Option<&'static ControlBlock>,
}

/// The result of one step of a search.
pub(crate) enum Progress {
    /// The search continues.
    More,
    /// The task is in no queue of ready tasks.
    Absent,
    /// The task is ready. [`Cursor::remove`] takes it from its queue.
    Ready,
}

impl Cursor {
    pub(crate) const fn new() -> Self {
        Cursor { before: None }
    }

    /// Whether the next step is the first, or the search restarts.
    pub(crate) fn is_at_start(&self, masked: &Masked) -> bool {
        self.before.is_none() || !traversal::is_valid(masked)
    }

    /// Takes one step along the queue of `task`. ISRs may append to it meanwhile.
    #[inline(never)]
    pub(crate) fn step(&mut self, masked: &Masked, task: &'static ControlBlock) -> Progress {
        let Some(last) = KERNEL.ready.last(task.level.get(masked)).task(masked) else {
            return Progress::Absent;
        };
        let before = match self.before {
            Some(before) if traversal::is_valid(masked) => before,
            _ => {
                traversal::begin(masked);
                last
            }
        };
        self.before = Some(before);
        let next = before.next_ready(masked);
        if next.is(task) {
            return Progress::Ready;
        }
        self.before = Some(next);
        if next.is(last) { Progress::Absent } else { Progress::More }
    }

    /// Removes `task` from its queue. The last step must have found it, in this critical section.
    #[inline(never)]
    pub(crate) fn remove(&self, masked: &Masked, task: &'static ControlBlock) {
        let ready = &KERNEL.ready;
        if let Some(before) = self.before {
            remove_behind(masked, ready.last(task.level.get(masked)), before, task);
        }
        if ready.head.get(masked).is(task) {
            update_head(masked);
        }
    }
}

impl Task {
    /// Lets tasks of the same priority that are ready run first. Returns at once when there is none.
    #[inline(always)]
    pub fn yield_now(&mut self) {
        if self.mask(rotate) {
            arch::switch(self);
        }
    }
}
