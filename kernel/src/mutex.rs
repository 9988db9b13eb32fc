//! Mutexes: values that several tasks change.

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

/// A value that one task at a time accesses, with interrupts enabled. 3 bytes besides the value.
///
/// ```
/// use kernel::{Mutex, Priority, Task};
/// static TOTAL: Mutex<u16> = Mutex::new(Priority::P2, 0);
/// fn add(task: &mut Task, amount: u16) {
///     *TOTAL.lock(task) += amount;
/// }
/// ```
///
/// It follows the immediate ceiling protocol: a task that holds the value runs at the mutex's ceiling, which
/// should be the highest priority of all tasks that lock it. Then no task ever waits for the mutex, and a
/// task is delayed by at most one locked section of a lower one. The holder can't block: the guard borrows
/// its context. A task above the ceiling may lock the mutex safely, too, but it may have to wait, also for
/// lower tasks. A guard that is forgotten keeps the mutex locked for good, and its task at the ceiling until
/// that task releases another mutex.
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

    /// Takes the value until the guard is dropped. For a task at the mutex's ceiling, locking takes 55 to 70
    /// cycles and dropping the guard 70; for a task below it, 100 to 120 and 160 to 200.
    pub fn lock<'a>(&'a self, task: &'a mut Task) -> Guard<'a, T> {
        self.lock.take(task);
        Guard { mutex: self, task }
    }

    /// Takes the value if no other task has it.
    pub fn try_lock<'a>(&'a self, task: &'a mut Task) -> Option<Guard<'a, T>> {
        // Not `then_some`: that makes a guard in any case, which would release the mutex when it is dropped.
        if self.lock.try_take(task) { Some(Guard { mutex: self, task }) } else { None }
    }

    /// Takes the value until the guard is dropped, if that is possible within `ticks` ticks. With 0 ticks it
    /// does not block.
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

/// Exclusive access to the value of a [`Mutex`], until this is dropped.
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
        // The holder hands the mutex to this task when it releases it. This task is above the ceiling, or it
        // would not have run while another task held the mutex: it need not be raised.
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

    /// Takes the mutex if it is free. If not, sets [`Flag::Locks`] already: the holder may hand it over
    /// before this task runs again.
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
        // Before it leaves the ceiling: otherwise a task in between could delay the one that waits.
        task.mask(|masked| self.free.word.signal(masked));
        arch::irq_window();
        if ready::restore(task) {
            arch::switch_from_call(task);
        }
    }
}
