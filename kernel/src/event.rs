//! Event flags: a task waits for any of several things.

use crate::arch;
use crate::context::{Context, Task};
use crate::masked::MaskedCell;
use crate::semaphore::{Came, Semaphore, Until};
use crate::walk;

/// Eight flags that tasks and interrupts set and tasks wait for. 3 bytes.
///
/// ```
/// use kernel::{EventFlags, Task};
/// static BUTTONS: EventFlags = EventFlags::new();
/// const LEFT: u8 = 1 << 0;
/// const RIGHT: u8 = 1 << 1;
/// fn next_button(task: &mut Task) -> u8 {
///     BUTTONS.wait_any(task, LEFT | RIGHT)
/// }
/// ```
///
/// A flag that is set stays so until a task takes it. Several tasks may wait, each for flags of its own; each
/// change wakes them all.
pub struct EventFlags {
    set: MaskedCell<u8>,
    changed: Semaphore,
}

impl Default for EventFlags {
    fn default() -> Self {
        Self::new()
    }
}

impl EventFlags {
    /// Flags of which none is set.
    pub const fn new() -> Self {
        EventFlags { set: MaskedCell::new(0), changed: Semaphore::new(0) }
    }

    /// Sets `flags`, and wakes the tasks that wait. In an interrupt that masks others for about 50 cycles a waiting task.
    pub fn set(&self, context: &mut impl Context, flags: u8) {
        context.mask(|masked| {
            self.set.set(masked, self.set.get(masked) | flags);
            walk::end(masked);
        });
        let mut is_due = false;
        while let Some(is_higher) = context.mask(|masked| self.changed.wake_first(masked)) {
            is_due |= is_higher;
        }
        context.reschedule(is_due);
    }

    /// Takes those of `flags` that are set, and blocks until there is one. Returns them, cleared.
    pub fn wait_any(&self, task: &mut Task, flags: u8) -> u8 {
        loop {
            let taken = self.take(task, flags);
            if taken != 0 {
                return taken;
            }
            self.block(task, Until::any(&self.set, flags));
        }
    }

    /// Takes all of `flags` at once, and blocks until all are set.
    pub fn wait_all(&self, task: &mut Task, flags: u8) {
        while !task.mask(|masked| {
            let set = self.set.get(masked);
            let are_all = set & flags == flags;
            if are_all {
                self.set.set(masked, set & !flags);
            }
            are_all
        }) {
            self.block(task, Until::all(&self.set, flags));
        }
    }

    /// Blocks until there is a change, unless `until` has come.
    fn block(&self, task: &mut Task, until: Until) {
        if self.changed.block_until(task, Some(&until)) == Came::Blocked {
            arch::switch_from_call();
        }
    }

    /// Takes those of `flags` that are set, without waiting: 0 if none is.
    pub fn take(&self, context: &mut impl Context, flags: u8) -> u8 {
        context.mask(|masked| {
            let taken = self.set.get(masked) & flags;
            self.set.set(masked, self.set.get(masked) & !taken);
            taken
        })
    }
}
