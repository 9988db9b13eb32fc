//! Lists of waiting tasks: by priority, in the order of arrival among equals.

use crate::masked::Masked;
use crate::task::ControlBlock;

/// Inserts `task` into the list that starts with `first`, and returns the list's new first.
///
/// Linear in the number of waiting tasks that `task` does not outrank: about 25 cycles each, masked.
pub(crate) fn insert(
    masked: &Masked,
    first: Option<&'static ControlBlock>,
    task: &'static ControlBlock,
) -> &'static ControlBlock {
    match first {
        Some(first) if !task.outranks(masked, first) => {
            insert_behind(masked, first, task);
            first
        }
        _ => {
            task.link.set(masked, first);
            task
        }
    }
}

#[cold]
fn insert_behind(masked: &Masked, first: &'static ControlBlock, task: &'static ControlBlock) {
    let mut before = first;
    while let Some(next) = before.link.get(masked) {
        if task.outranks(masked, next) {
            break;
        }
        before = next;
    }
    task.link.set(masked, before.link.get(masked));
    before.link.set(masked, Some(task));
}
