//! Which task runs: a list of preempted tasks and a queue for each priority, both constant in time.
//!
//! A task that becomes ready either outranks the running one, and is pushed before it, or it does not,
//! and joins the queue of those that *arrived* at its priority. So the list that starts at `head` holds
//! the task to run, then those it preempted, in strictly falling priority, the idle task last; it is at
//! most nine long. When the head blocks, the next is the rest of the list, unless a task of higher
//! priority has arrived meanwhile; one byte, a bit for each priority, tells.
//!
//! `head` is what should run, `running` is what does. Where they differ a switch is due: a task makes
//! it at once, an interrupt at its end. A switch that an interrupt made first is made in vain, which
//! does no harm. So the lists can change with interrupts masked for a few cycles, and the switch comes after.

use crate::KERNEL;
use crate::arch;
use crate::context::{Context, Task};
use crate::link::Link;
use crate::masked::{Masked, MaskedCell};
use crate::task::{ControlBlock, Flag};
use crate::walk;

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

/// Takes the running task, which is the head, from the ready ones, and links it as `link`; the next takes its place.
///
/// `None`, with nothing done, where a task that has arrived should run before the next: see [`pull`].
#[inline(always)]
pub(crate) fn block(masked: &Masked, link: Link) -> Option<&'static ControlBlock> {
    let ready = &KERNEL.ready;
    let (task, next, above) = arch::head_and_next(masked);
    if ready.arrived.get(masked) & above != 0 {
        return None;
    }
    ready.head.set(masked, next);
    task.link.set(masked, link);
    walk::end(masked);
    Some(task)
}

/// Blocks the running task, linked as `link`, unless `is_over`, which is asked in the same masked section. Returns it if it
/// has blocked, and a switch is due.
#[inline(always)]
pub(crate) fn block_unless(
    task: &mut Task,
    link: Link,
    is_over: impl Fn(&Masked) -> bool,
) -> Option<&'static ControlBlock> {
    loop {
        let (is_over, blocked) = task.mask(|masked| {
            let is_over = is_over(masked);
            (is_over, if is_over { None } else { block(masked, link) })
        });
        if is_over {
            arch::push(task);
        }
        if is_over || blocked.is_some() {
            return blocked;
        }
        arch::pull(task);
    }
}

/// Takes the running task from the ready ones, and does `then` in the same masked section.
#[inline(always)]
pub(crate) fn retire<R>(task: &mut Task, then: impl Fn(&'static ControlBlock, &Masked) -> R) -> R {
    loop {
        let result = task.mask(|masked| block(masked, Link::PARKED).map(|task| then(task, masked)));
        match result {
            Some(result) => return result,
            None => arch::pull(task),
        }
    }
}

/// Puts the highest task that has arrived behind the running one, if it should run before what is there.
///
/// A section of its own, since interrupts are masked meanwhile. A task of the running one's own priority must not
/// stay there unless that blocks: [`push`] puts it back.
#[cfg(not(target_arch = "avr"))]
pub(crate) fn pull(task: &mut Task) {
    let among = |masked: &Masked| {
        let ready = &KERNEL.ready;
        ready.arrived.get(masked) & ready.head.get(masked).next_ready(masked).above.get(masked)
    };
    let queue = highest(task.mask(among));
    arch::part_sections();
    task.mask(|masked| {
        // If a higher one has arrived meanwhile, it is pulled before this one next.
        if let Some(first) = take_arrived(masked, among(masked), queue) {
            let task = KERNEL.ready.head.get(masked);
            first.link.set(masked, task.link.get(masked));
            task.link.set(masked, Link::to(first));
        }
    });
}

/// Makes the highest task that has arrived the head, if it outranks that: where no task runs, the head before may be gone.
pub(crate) fn refill(masked: &Masked) {
    let ready = &KERNEL.ready;
    let head = ready.head.get(masked);
    let among = ready.arrived.get(masked) & head.above.get(masked);
    if among != 0
        && let Some(first) = take_arrived(masked, among, highest(among))
    {
        first.link.set(masked, Link::to(head));
        ready.head.set(masked, first);
    }
}

/// Puts what [`pull`] has taken back as the first of its queue, where the running task does not block after all.
#[cfg(not(target_arch = "avr"))]
pub(crate) fn push(task: &mut Task) {
    task.mask(|masked| {
        let ready = &KERNEL.ready;
        let task = ready.head.get(masked);
        let next = task.next_ready(masked);
        if next.outranks(masked, task) || task.outranks(masked, next) {
            return;
        }
        let last = &ready.last[next.index(masked)];
        task.link.set(masked, next.link.get(masked));
        match last.get(masked) {
            Some(last) => {
                next.link.set(masked, last.link.get(masked));
                last.link.set(masked, Link::to(next));
            }
            None => begin_queue(masked, last, next),
        }
    });
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

/// Undoes [`raise`]. Returns whether another task is the head now, or was before.
pub(crate) fn restore(task: &mut Task) -> bool {
    // No ceiling within a ceiling: who has one can't lock another mutex.
    let above = task.mask(running).above_priority(task);
    loop {
        let among = task.mask(|masked| {
            let among = KERNEL.ready.arrived.get(masked) & above;
            if among == 0 {
                lift(masked, running(masked), above);
            }
            among
        });
        if among == 0 {
            return task.mask(is_due);
        }
        // The ceiling holds until the first of those that it held up is the head.
        let queue = highest(among);
        if task.mask(|masked| restore_to_arrived(masked, above, queue)) {
            return true;
        }
    }
}

/// Ends the ceiling under which `task` runs.
#[inline(always)]
fn lift(masked: &Masked, task: &ControlBlock, above: u8) {
    task.above.set(masked, above);
    task.clear_flag(masked, Flag::Locks);
}

/// Restores `above`, and makes the first task of `queue` the head; `false`, with nothing done, where a higher one has arrived
/// meanwhile.
fn restore_to_arrived(masked: &Masked, above: u8, queue: &Last) -> bool {
    let ready = &KERNEL.ready;
    let task = running(masked);
    let head = ready.head.get(masked);
    if !head.is(task) {
        // What was woken outranks the ceiling, so it outranks those that arrived.
        lift(masked, task, above);
        return true;
    }
    let among = ready.arrived.get(masked) & above;
    let Some(first) = take_arrived(masked, among, queue) else { return false };
    lift(masked, task, above);
    first.link.set(masked, Link::to(task));
    ready.head.set(masked, first);
    true
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
#[inline(always)]
pub(crate) fn last_arrived(masked: &Masked, task: &ControlBlock) -> Option<&'static ControlBlock> {
    KERNEL.ready.last[task.index(masked)].get(masked)
}

/// Takes `task` from those that arrived at its priority, where it stands behind `before`.
#[inline(always)]
pub(crate) fn take_after(masked: &Masked, before: &'static ControlBlock, task: &'static ControlBlock) {
    let ready = &KERNEL.ready;
    let last = &ready.last[task.index(masked)];
    if before.is(task) {
        last.set(masked, None);
        ready.arrived.set(masked, ready.arrived.get(masked) & !task.bit(masked));
        return;
    }
    before.link.set(masked, task.link.get(masked));
    if last.get(masked).is_some_and(|last| last.is(task)) {
        last.set(masked, Some(before));
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

/// Takes the first task from `queue`; `None`, with nothing done, where its priority is not the highest in `among`.
#[inline(always)]
fn take_arrived(masked: &Masked, among: u8, queue: &Last) -> Option<&'static ControlBlock> {
    let ready = &KERNEL.ready;
    let last = queue.get(masked)?;
    let bit = last.bit(masked);
    if among & among.wrapping_neg() != bit {
        return None;
    }
    let (first, is_only) = take_first(masked, queue, last);
    if is_only {
        ready.arrived.set(masked, ready.arrived.get(masked) & !bit);
    }
    Some(first)
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

/// The queue of the highest priority in the set `among`; the lowest in an empty set.
fn highest(among: u8) -> &'static Last {
    let (offset, four) = if among & 0x0f == 0 { (4, among >> 4) } else { (0, among) };
    let (offset, two) = if four & 0x03 == 0 { (offset + 2, four >> 2) } else { (offset, four) };
    let priority: usize = if two & 0x01 == 0 { offset + 1 } else { offset };
    arch::found(&KERNEL.ready.last[priority & 7])
}
