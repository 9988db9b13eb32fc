//! Which task runs: a list of preempted tasks and a queue for each priority, both constant in time.
//!
//! A task that becomes ready either outranks the running one, and is pushed before it, or it does not,
//! and joins the queue of those that *arrived* at its priority. So the list that starts at `head` holds
//! the task to run, then those it preempted, in strictly falling priority, the idle task last; it is at
//! most nine long. When the head blocks, the next is the rest of the list, unless a task of higher
//! priority has arrived meanwhile; one byte, a bit for each priority, tells. Then the head is the
//! *scheduler*, which is no task: the switch that follows finds the highest that has arrived, with
//! interrupts enabled. Nothing outranks the scheduler, so whoever is woken before that arrives too.
//!
//! `head` is what should run, `running` is what does. Where they differ a switch is due: a task makes
//! it at once, an interrupt at its end. A switch that an interrupt made first is made in vain, which
//! does no harm. So the lists can change with interrupts masked for a few cycles, and the switch comes after.

use crate::arch;
use crate::context::{Context, Task};
use crate::link::Link;
use crate::masked::{Masked, MaskedCell};
use crate::task::{ControlBlock, Flag};
use crate::walk;
use crate::{KERNEL, SCHEDULER};

/// The state of the scheduler. `repr(C)`: the context switch reads its first two fields.
#[repr(C)]
pub(crate) struct Ready {
    /// The task that should run.
    pub(crate) head: MaskedCell<&'static ControlBlock>,
    /// The task whose registers are in the CPU.
    pub(crate) running: MaskedCell<&'static ControlBlock>,
    /// The priorities at which tasks have arrived, a bit each.
    pub(crate) arrived: MaskedCell<u8>,
    /// For each of these the last task to arrive; its link is the first.
    pub(crate) last: [Last; 8],
}

/// The last task of a queue, if there is one.
pub(crate) type Last = MaskedCell<Option<&'static ControlBlock>>;

impl Ready {
    pub(crate) const fn new(idle: &'static ControlBlock) -> Self {
        Ready {
            head: MaskedCell::new(idle),
            running: MaskedCell::new(idle),
            arrived: MaskedCell::new(0),
            last: [const { MaskedCell::new(None) }; 8],
        }
    }
}

#[cfg(not(target_arch = "avr"))]
impl Ready {
    /// As at the start: only the idle task.
    pub(crate) fn reset(&self, masked: &Masked, idle: &'static ControlBlock) {
        self.head.set(masked, idle);
        self.running.set(masked, idle);
        self.arrived.set(masked, 0);
        self.last.iter().for_each(|last| last.set(masked, None));
        // A mutex given back by a task that was dropped has changed it.
        idle.above.set(masked, 0xff);
    }
}

/// Puts `task` before the head if it outranks that. Returns whether it did.
#[inline(always)]
pub(crate) fn preempt(masked: &Masked, task: &'static ControlBlock) -> bool {
    let (head, above) = arch::head_and_above(masked);
    let outranks = task.above.get(masked) < above;
    if outranks {
        task.link.set(masked, Link::to(head));
        arch::set_head(masked, task);
    }
    outranks
}

/// Takes the head from the ready ones, and links it as `link`; the next takes its place. Returns it.
#[inline(always)]
pub(crate) fn block(masked: &Masked, link: Link) -> &'static ControlBlock {
    let task = leave_head(masked);
    task.link.set(masked, link);
    walk::end(masked);
    task
}

/// The same, which leaves its link as it is, and walks as they are.
#[inline(always)]
pub(crate) fn leave_head(masked: &Masked) -> &'static ControlBlock {
    let task = KERNEL.ready.head.get(masked);
    put_head(masked, task.next_ready(masked));
    task
}

/// Makes `next` the head, unless it is outranked by one that has arrived: then the scheduler, which finds that.
#[inline(always)]
pub(crate) fn put_head(masked: &Masked, next: &'static ControlBlock) {
    let ready = &KERNEL.ready;
    let is_outranked = ready.arrived.get(masked) & next.above.get(masked) != 0;
    if is_outranked {
        SCHEDULER.link.set(masked, Link::to(next));
    }
    ready.head.set(masked, if is_outranked { &SCHEDULER } else { next });
}

/// Blocks the running task, linked as `link`, unless `is_over`, which is asked in the same masked section. Returns whether it
/// has blocked, and a switch is due.
#[inline(always)]
pub(crate) fn block_unless(task: &mut Task, link: Link, is_over: impl Fn(&Masked) -> bool) -> bool {
    task.mask(|masked| {
        let is_over = is_over(masked);
        if !is_over {
            block(masked, link);
        }
        !is_over
    })
}

/// Takes the running task, which is the head, from the ready ones; who runs next is left to the scheduler. Returns it, whose link is
/// to be set.
#[inline(never)]
pub(crate) fn retire(masked: &Masked) -> &'static ControlBlock {
    let task = KERNEL.ready.head.get(masked);
    SCHEDULER.link.set(masked, task.link.get(masked));
    KERNEL.ready.head.set(masked, &SCHEDULER);
    walk::end(masked);
    task
}

/// The scheduler, which is the head: puts the first of the highest that have arrived before the next task, if it outranks that.
#[cfg(not(target_arch = "avr"))]
pub(crate) fn schedule(masked: &Masked) {
    let ready = &KERNEL.ready;
    let next = SCHEDULER.next_ready(masked);
    let among = ready.arrived.get(masked) & next.above.get(masked);
    let Some(last) = ready.last.get(among.trailing_zeros() as usize) else {
        ready.head.set(masked, next); // who had arrived was suspended
        return;
    };
    let Some((first, is_only)) = last.get(masked).map(|task| take_first(masked, last, task)) else { return };
    if is_only {
        ready.arrived.set(masked, ready.arrived.get(masked) & !first.bit(masked));
    }
    first.link.set(masked, Link::to(next));
    ready.head.set(masked, first);
}

/// The running task, to that task itself.
#[inline(always)]
pub(crate) fn running(masked: &Masked) -> &'static ControlBlock {
    KERNEL.ready.running.get(masked)
}

/// Whether the head is another task than the running one.
pub(crate) fn is_due(masked: &Masked) -> bool {
    !KERNEL.ready.head.get(masked).is(running(masked))
}

/// Puts the running task behind those that arrived at its priority, and their first in its place. Returns
/// it if there is one, and a switch is due.
#[cfg(not(target_arch = "avr"))]
pub(crate) fn rotate(task: &mut Task) -> Option<&'static ControlBlock> {
    task.mask(|masked| {
        let ready = &KERNEL.ready;
        let task = ready.head.get(masked);
        let last = &ready.last[task.index(masked)];
        let previous = last.get(masked)?;
        last.set(masked, Some(task));
        let first = previous.next_ready(masked);
        // Before the read of `first`'s link: if `first` was alone, that is now `task`, and the ring closes.
        previous.link.set(masked, Link::to(task));
        let second = first.link.get(masked);
        first.link.set(masked, task.link.get(masked));
        task.link.set(masked, second);
        ready.head.set(masked, first);
        Some(task)
    })
}

/// Lets only the priorities in `ceiling` preempt the running task, if that is fewer than do now, until [`restore`].
#[inline(always)]
pub(crate) fn raise(masked: &Masked, ceiling: u8) {
    let task = KERNEL.ready.head.get(masked);
    let above = task.above.get(masked);
    task.above.set(masked, above & ceiling);
    task.set_flag(masked, Flag::Locks);
}

/// Undoes [`raise`]. Returns whether another task is to run now, or was before.
pub(crate) fn restore(task: &mut Task) -> bool {
    // No ceiling within a ceiling: who has one can't lock another mutex.
    let above = task.mask(running).above_priority(task);
    task.mask(|masked| {
        let task = running(masked);
        task.above.set(masked, above);
        task.clear_flag(masked, Flag::Locks);
        // What was woken meanwhile and is the head outranks the ceiling, so it outranks those that arrived.
        if KERNEL.ready.head.get(masked).is(task) {
            put_head(masked, task);
        }
        is_due(masked)
    })
}

/// Appends `task` to those that arrived at its priority.
#[cfg(not(target_arch = "avr"))]
pub(crate) fn append(masked: &Masked, task: &'static ControlBlock) {
    let last = &KERNEL.ready.last[task.index(masked)];
    match last.get(masked) {
        Some(previous) => {
            task.link.set(masked, previous.link.get(masked));
            previous.link.set(masked, Link::to(task));
            last.set(masked, Some(task));
        }
        None => begin_queue(masked, last, task),
    }
}

/// The last task that arrived at `task`'s priority.
#[cfg(not(target_arch = "avr"))]
pub(crate) fn last_arrived(masked: &Masked, task: &ControlBlock) -> Option<&'static ControlBlock> {
    KERNEL.ready.last[task.index(masked)].get(masked)
}

/// Who stands behind `before` among those that are ready; the head without a `before`. Nobody is behind the idle task.
#[cfg(not(target_arch = "avr"))]
pub(crate) fn behind(
    masked: &Masked,
    before: Option<&'static ControlBlock>,
) -> Option<&'static ControlBlock> {
    match before {
        Some(before) => before.link.get(masked).task(),
        None => Some(KERNEL.ready.head.get(masked)),
    }
}

/// Takes `task` from where it stands behind `before`, as [`behind`] says.
#[cfg(not(target_arch = "avr"))]
pub(crate) fn take_after(
    masked: &Masked,
    before: Option<&'static ControlBlock>,
    task: &'static ControlBlock,
) {
    let ready = &KERNEL.ready;
    match before {
        Some(before) => before.link.set(masked, task.link.get(masked)),
        None => {
            leave_head(masked);
        }
    }
    let last = &ready.last[task.index(masked)];
    if !last.get(masked).is_some_and(|last| last.is(task)) {
        return;
    }
    // It was the last of those that have arrived, and perhaps the only one.
    let now_last = before.filter(|before| !before.is(task));
    last.set(masked, now_last);
    if now_last.is_none() {
        ready.arrived.set(masked, ready.arrived.get(masked) & !task.bit(masked));
    }
}

/// Makes `task` the only one that arrived at its priority.
#[cfg(not(target_arch = "avr"))]
fn begin_queue(masked: &Masked, last: &Last, task: &'static ControlBlock) {
    let ready = &KERNEL.ready;
    last.set(masked, Some(task));
    task.link.set(masked, Link::to(task));
    ready.arrived.set(masked, ready.arrived.get(masked) | task.bit(masked));
}

/// Takes the first task from the queue whose last is `last`, as `cell` holds. Returns it, and whether it was the only one.
#[inline(always)]
pub(crate) fn take_first(
    masked: &Masked,
    cell: &Last,
    last: &'static ControlBlock,
) -> (&'static ControlBlock, bool) {
    let first = last.next_ready(masked);
    let is_only = first.is(last);
    if is_only {
        cell.set(masked, None);
    } else {
        last.link.set(masked, first.link.get(masked));
    }
    (first, is_only)
}
