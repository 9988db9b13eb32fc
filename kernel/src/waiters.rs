//! Lists of waiting tasks: by priority, in the order of arrival among equals.

use crate::masked::Masked;
use crate::task::ControlBlock;

/// Inserts `task` into the list that starts with `first`, and returns the list's new first.
///
/// Linear in the number of waiting tasks that `task` does not outrank: about 20 cycles each, masked.
#[cold]
#[inline(never)]
pub(crate) fn insert(
    masked: &Masked,
    first: &'static ControlBlock,
    task: &'static ControlBlock,
) -> &'static ControlBlock {
    if task.outranks(masked, first) {
        task.set_next(masked, Some(first));
        return task;
    }
    let mut before = first;
    while let Some(next) = before.next_waiting(masked)
        && !task.outranks(masked, next)
    {
        before = next;
    }
    task.set_next(masked, before.next_waiting(masked));
    before.set_next(masked, Some(task));
    first
}

/// Removes `task` from behind `first` in its list. Returns whether it was there.
#[inline(never)]
pub(crate) fn remove(masked: &Masked, first: &'static ControlBlock, task: &'static ControlBlock) -> bool {
    let mut before = first;
    while let Some(next) = before.next_waiting(masked) {
        if next.is(task) {
            before.set_next(masked, task.next_waiting(masked));
            return true;
        }
        before = next;
    }
    false
}
