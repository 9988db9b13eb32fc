//! Event flags: a task waits for any or all of several flags.

use crate::arch;
use crate::context::{Context, Task};
use crate::critical::{Masked, MaskedCell};
use crate::proxy::Elapsed;
use crate::semaphore::Semaphore;
use crate::timer::{Ticks, deadline_in};
use crate::traversal;
use crate::wait::WakeCondition;

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
    /// Flags that are all clear.
    pub const fn new() -> Self {
        EventFlags { set: MaskedCell::new(0), changed: Semaphore::new(0) }
    }

    /// Sets `flags`, and wakes all tasks that wait. In an interrupt this masks other interrupts for about 120
    /// cycles per waiting task, and 200 if its wait has a timeout.
    pub fn set(&self, context: &mut impl Context, flags: u8) {
        let is_task = !context.is_interrupt();
        context.mask(|masked| {
            self.set.set(masked, self.set.get(masked) | flags);
            if is_task {
                // Being a traversal, all this is one step of `TaskHandle::step`. In several steps, a task
                // that is woken in one and waits again would be woken again in the next.
                traversal::begin(masked);
            }
        });
        let wake = |masked: &Masked| {
            let woken = self.changed.word.wake_first(masked);
            if is_task && woken.is_none() {
                traversal::end(masked);
            }
            woken
        };
        let mut is_due = false;
        while let Some(is_higher) = context.mask(wake) {
            is_due |= is_higher;
            arch::irq_window();
        }
        context.reschedule(is_due);
    }

    /// Takes those of `flags` that are set, and blocks until there is one: for ever if `flags` is 0. Returns
    /// them, cleared.
    pub fn wait_any(&self, task: &mut Task, flags: u8) -> u8 {
        loop {
            let taken = self.take(task, flags);
            if taken != 0 {
                return taken;
            }
            self.block(task, WakeCondition::any(&self.set, flags));
        }
    }

    /// As [`wait_any`](Self::wait_any), for `ticks` ticks at most. With 0 ticks it does not block.
    ///
    /// # Errors
    /// [`Elapsed`] when the time is up. No flag was taken then.
    pub fn wait_any_timeout(&self, task: &mut Task, flags: u8, ticks: Ticks) -> Result<u8, Elapsed> {
        let deadline = deadline_in(task, ticks);
        loop {
            let taken = self.take(task, flags);
            if taken != 0 {
                return Ok(taken);
            }
            if ticks == 0 {
                return Err(Elapsed);
            }
            self.changed.wait_until(task, deadline, Some(&WakeCondition::any(&self.set, flags)))?;
        }
    }

    /// Takes all of `flags` at once, and blocks until all are set.
    pub fn wait_all(&self, task: &mut Task, flags: u8) {
        while !self.take_all(task, flags) {
            self.block(task, WakeCondition::all(&self.set, flags));
        }
    }

    /// As [`wait_all`](Self::wait_all), for `ticks` ticks at most. With 0 ticks it does not block.
    ///
    /// # Errors
    /// [`Elapsed`] when the time is up. No flag was taken then.
    pub fn wait_all_timeout(&self, task: &mut Task, flags: u8, ticks: Ticks) -> Result<(), Elapsed> {
        let deadline = deadline_in(task, ticks);
        while !self.take_all(task, flags) {
            if ticks == 0 {
                return Err(Elapsed);
            }
            self.changed.wait_until(task, deadline, Some(&WakeCondition::all(&self.set, flags)))?;
        }
        Ok(())
    }

    /// Takes all of `flags` if all are set. Returns whether they were.
    fn take_all(&self, task: &mut Task, flags: u8) -> bool {
        task.mask(|masked| {
            let set = self.set.get(masked);
            let are_all = set & flags == flags;
            if are_all {
                self.set.set(masked, set & !flags);
            }
            are_all
        })
    }

    /// Blocks until there is a change, unless `condition` holds.
    fn block(&self, task: &mut Task, condition: WakeCondition) {
        if self.changed.word.block_unless(task, &condition) {
            arch::switch_from_call(task);
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
