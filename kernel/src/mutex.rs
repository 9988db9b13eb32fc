//! Values that several tasks change.

use core::cell::UnsafeCell;

use crate::arch;
use crate::context::{Context, Task};
use crate::ready;

/// A value that one task at a time works on, with interrupts enabled.
///
/// ```
/// use kernel::{Mutex, Task};
/// static TOTAL: Mutex<u16> = Mutex::new(0);
/// fn add(task: &mut Task, amount: u16) {
///     TOTAL.with(task, |total| *total += amount);
/// }
/// ```
///
/// While a task works on it, it runs at the highest priority (the immediate ceiling protocol with one ceiling
/// for all). So it never waits, there is no queue and no deadlock, and what it delays others by is the length
/// of its own work. It can't block meanwhile: `with` borrows the task's context. It costs no RAM but the value.
#[repr(transparent)]
pub struct Mutex<T>(UnsafeCell<T>);

// SAFETY: `with` gives the value to one task at a time, and no interrupt has a `Task` to call it with.
unsafe impl<T: Send> Sync for Mutex<T> {}

impl<T> Mutex<T> {
    /// A mutex around `value`.
    pub const fn new(value: T) -> Self {
        Mutex(UnsafeCell::new(value))
    }

    /// Runs `work` on the value. About 40 cycles, of which 20 masked, besides `work`.
    pub fn with<R>(&self, task: &mut Task, work: impl FnOnce(&mut T) -> R) -> R {
        let above = task.mask(ready::raise);
        // SAFETY: nothing outranks this task now, and it can neither block nor call `with` while `work` runs:
        // both need `task`, which is borrowed. So no other task works on the value.
        let result = work(unsafe { &mut *self.0.get() });
        if task.mask(|masked| ready::restore(masked, above)) {
            arch::switch_from_call();
        }
        result
    }
}
