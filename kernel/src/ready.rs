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
use crate::masked::{Masked, MaskedCell};
use crate::task::ControlBlock;

/// The state of the scheduler. `repr(C)`: the context switch reads its first two fields.
#[repr(C)]
pub(crate) struct Ready {
    /// The task that should run.
    pub(crate) head: MaskedCell<&'static ControlBlock>,
    /// The task whose registers are in the CPU.
    pub(crate) running: MaskedCell<&'static ControlBlock>,
    /// The priorities at which tasks have arrived, a bit each.
    arrived: MaskedCell<u8>,
    /// For each of these the last task to arrive; its link is the first.
    last: [MaskedCell<Option<&'static ControlBlock>>; 8],
}

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
    }
}

/// Makes `task` ready. Returns whether it is now the one to run.
#[inline(always)]
pub(crate) fn make_ready(masked: &Masked, task: &'static ControlBlock) -> bool {
    let head = KERNEL.ready.head.get(masked);
    let is_highest = task.outranks(masked, head);
    if is_highest {
        task.set_next(masked, Some(head));
        KERNEL.ready.head.set(masked, task);
    } else {
        arrive(masked, task);
    }
    is_highest
}

/// Takes the running task, which is the head, from the ready ones; the next takes its place.
#[inline(never)]
pub(crate) fn block(masked: &Masked) -> &'static ControlBlock {
    let ready = &KERNEL.ready;
    let task = ready.head.get(masked);
    let rest = task.next_ready(masked);
    ready.head.set(masked, rest);
    let higher = ready.arrived.get(masked) & rest.above.get(masked);
    if higher != 0 {
        run_arrived(masked, higher);
    }
    task
}

/// [`block`] where none that arrived is to run next; `None` where one is. The common case, without a call in it.
#[inline(always)]
pub(crate) fn block_simply(masked: &Masked) -> Option<&'static ControlBlock> {
    let ready = &KERNEL.ready;
    let task = ready.head.get(masked);
    let rest = task.next_ready(masked);
    if ready.arrived.get(masked) & rest.above.get(masked) != 0 {
        return None;
    }
    ready.head.set(masked, rest);
    Some(task)
}

/// The running task, to that task itself.
pub(crate) fn running(masked: &Masked) -> &'static ControlBlock {
    KERNEL.ready.running.get(masked)
}

/// Whether the head is another task than the running one.
pub(crate) fn is_due(masked: &Masked) -> bool {
    !KERNEL.ready.head.get(masked).is(running(masked))
}

/// Puts the running task behind those that arrived at its priority, and their first in its place. Returns
/// whether there is one.
#[inline(never)]
pub(crate) fn rotate(masked: &Masked) -> bool {
    let ready = &KERNEL.ready;
    let task = ready.head.get(masked);
    let last = &ready.last[task.index(masked)];
    let Some(previous) = last.get(masked) else { return false };
    last.set(masked, Some(task));
    let first = previous.next_ready(masked);
    // Before the read of `first`'s link: if `first` was alone, that is now `task`, and the ring closes.
    previous.set_next(masked, Some(task));
    let second = first.next_ready(masked);
    first.set_next(masked, Some(task.next_ready(masked)));
    task.set_next(masked, Some(second));
    ready.head.set(masked, first);
    true
}

/// Lets only the priorities in `ceiling` preempt the running task, if that is fewer than do now. Returns those, for
/// [`restore`].
pub(crate) fn raise(masked: &Masked, ceiling: u8) -> u8 {
    let task = KERNEL.ready.head.get(masked);
    let above = task.above.get(masked);
    task.above.set(masked, above & ceiling);
    above
}

/// Undoes [`raise`]. Returns whether a task of higher priority has arrived meanwhile, and is the head now.
pub(crate) fn restore(masked: &Masked, above: u8) -> bool {
    let ready = &KERNEL.ready;
    let task = ready.head.get(masked);
    task.above.set(masked, above);
    let higher = ready.arrived.get(masked) & above;
    if higher != 0 {
        run_arrived(masked, higher);
    }
    higher != 0
}

/// Appends `task` to those that arrived at its priority.
#[inline(never)]
fn arrive(masked: &Masked, task: &'static ControlBlock) {
    let ready = &KERNEL.ready;
    let last = &ready.last[task.index(masked)];
    match last.get(masked) {
        None => {
            task.set_next(masked, Some(task));
            ready.arrived.set(masked, ready.arrived.get(masked) | task.bit(masked));
        }
        Some(previous) => {
            task.set_next(masked, Some(previous.next_ready(masked)));
            previous.set_next(masked, Some(task));
        }
    }
    last.set(masked, Some(task));
}

/// Puts the first task of the highest priority in `among`, at which some have arrived, before the head.
#[inline(never)]
fn run_arrived(masked: &Masked, among: u8) {
    let ready = &KERNEL.ready;
    let last = &ready.last[highest(among)];
    let Some(final_one) = last.get(masked) else { return };
    let first = final_one.next_ready(masked);
    if first.is(final_one) {
        last.set(masked, None);
        ready.arrived.set(masked, ready.arrived.get(masked) & !first.bit(masked));
    } else {
        final_one.set_next(masked, Some(first.next_ready(masked)));
    }
    first.set_next(masked, Some(ready.head.get(masked)));
    ready.head.set(masked, first);
}

/// The index of the highest priority in the set `among`; 7 in an empty set. At most 12 cycles.
#[inline(always)]
fn highest(among: u8) -> usize {
    let (offset, four) = if among & 0x0f == 0 { (4, among >> 4) } else { (0, among) };
    let (offset, two) = if four & 0x03 == 0 { (offset + 2, four >> 2) } else { (offset, four) };
    if two & 0x01 == 0 { offset + 1 } else { offset }
}
