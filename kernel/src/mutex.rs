//! Values that several tasks change.

use core::cell::UnsafeCell;
use core::ops::{Deref, DerefMut};

use crate::arch;
use crate::context::{Context, Task};
use crate::control_block::{Flag, Priority};
use crate::critical::Masked;
use crate::proxy::Elapsed;
use crate::ready;
use crate::semaphore::Semaphore;
use crate::timer::Ticks;

/// A value that one task at a time works on, with interrupts enabled. 3 bytes besides the value.
///
/// ```
/// use kernel::{Mutex, Priority, Task};
/// static TOTAL: Mutex<u16> = Mutex::new(Priority::P2, 0);
/// fn add(task: &mut Task, amount: u16) {
///     *TOTAL.lock(task) += amount;
/// }
/// ```
///
/// The immediate ceiling protocol: who holds the value runs at the mutex's ceiling, which should be the
/// highest priority of all tasks that lock it. Then no task ever waits for it, and what a task is delayed by
/// is one section of a lower one at most. It can't block while it holds the value: the guard borrows its
/// context. A task above the ceiling may lock it too, safely; it may have to wait, and then for lower tasks
/// as well. A guard that is forgotten keeps the mutex taken for good, and its task at the ceiling until that
/// gives another one.
#[repr(C)]
pub struct Mutex<T> {
    /// First, where debuggers and other readers of RAM find it by the mutex's symbol.
    value: UnsafeCell<T>,
    lock: Lock,
}

// SAFETY: a guard is the only way to the value, and while there is one, its lock is taken.
unsafe impl<T: Send> Sync for Mutex<T> {}

impl<T> Mutex<T> {
    /// A mutex around `value`, with the ceiling `ceiling`.
    pub const fn new(ceiling: Priority, value: T) -> Self {
        let lock = Lock { ceiling: ceiling as u8, free: Semaphore::new(1) };
        Mutex { value: UnsafeCell::new(value), lock }
    }

    /// Takes the value until the guard is dropped. At the mutex's ceiling 55 to 70 cycles, and 70 then; below
    /// it 100 to 120, and 160 to 200 then.
    pub fn lock<'a>(&'a self, task: &'a mut Task) -> Guard<'a, T> {
        self.lock.take(task);
        Guard { mutex: self, task }
    }

    /// Takes the value if no other task has it.
    pub fn try_lock<'a>(&'a self, task: &'a mut Task) -> Option<Guard<'a, T>> {
        // Not `then_some`: that makes a guard in any case, which gives the mutex where it is dropped.
        if self.lock.try_take(task) { Some(Guard { mutex: self, task }) } else { None }
    }

    /// Takes the value until the guard is dropped, if it comes within `ticks` ticks. With 0 ticks it does not
    /// block.
    ///
    /// # Errors
    /// [`Elapsed`] when the time is up.
    pub fn lock_timeout<'a>(&'a self, task: &'a mut Task, ticks: Ticks) -> Result<Guard<'a, T>, Elapsed> {
        self.lock.take_timeout(task, ticks)?;
        Ok(Guard { mutex: self, task })
    }

    /// Runs `work` on the value.
    pub fn with<R>(&self, task: &mut Task, work: impl FnOnce(&mut T) -> R) -> R {
        work(&mut self.lock(task))
    }
}

/// The value of a [`Mutex`], and the right to it until this is dropped.
pub struct Guard<'a, T> {
    mutex: &'a Mutex<T>,
    task: &'a mut Task,
}

impl<T> Deref for Guard<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        // SAFETY: the lock is taken, and this is its one guard.
        unsafe { &*self.mutex.value.get() }
    }
}

impl<T> DerefMut for Guard<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        // SAFETY: the lock is taken, and this is its one guard.
        unsafe { &mut *self.mutex.value.get() }
    }
}

impl<T> Drop for Guard<'_, T> {
    fn drop(&mut self) {
        self.mutex.lock.give(self.task);
    }
}

/// A mutex without its value.
struct Lock {
    /// The queue of ready tasks that its owner is in.
    ceiling: u8,
    /// Holds one signal while the mutex is free.
    free: Semaphore,
}

impl Lock {
    #[inline(never)]
    fn take(&self, task: &mut Task) {
        // The task that gives it hands it to this one, which is above the ceiling: else it would not have run
        // while another had the mutex.
        if self.begin(task) {
            return;
        }
        arch::irq_window();
        if self.free.word.block(task) {
            arch::switch_from_call(task);
        }
    }

    fn try_take(&self, task: &mut Task) -> bool {
        task.mask(|masked| self.take_at_once(masked))
    }

    #[inline(never)]
    fn take_timeout(&self, task: &mut Task, ticks: Ticks) -> Result<(), Elapsed> {
        if self.begin(task) {
            return Ok(());
        }
        self.free
            .wait_timeout(task, ticks)
            .inspect_err(|Elapsed| task.mask(|masked| ready::running(masked).clear_flag(masked, Flag::Locks)))
    }

    fn take_at_once(&self, masked: &Masked) -> bool {
        let is_taken = self.free.word.take(masked);
        if is_taken {
            ready::raise(masked, self.ceiling);
        }
        is_taken
    }

    /// Takes the mutex if it is free. From here on the task may own it without knowing.
    fn begin(&self, task: &mut Task) -> bool {
        task.mask(|masked| {
            let is_taken = self.take_at_once(masked);
            if !is_taken {
                ready::running(masked).set_flag(masked, Flag::Locks);
            }
            is_taken
        })
    }

    #[inline(never)]
    fn give(&self, task: &mut Task) {
        // Before the ceiling is left, or a task between the two could hold up the one that waits.
        task.mask(|masked| self.free.word.signal(masked));
        arch::irq_window();
        if ready::restore(task) {
            arch::switch_from_call(task);
        }
    }
}
