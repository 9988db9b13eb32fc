//! What one task does to another.

use crate::arch;
use crate::context::{Context, Private, Task, ThreadContext};
use crate::link::Link;
use crate::list::{self, Found, Suspension};
use crate::masked::Masked;
use crate::ready;
use crate::task::{ControlBlock, Flag, Never, Priority};
use crate::timer;

/// A task, to others: see [`Stack::task`](crate::Stack::task).
#[derive(Clone, Copy)]
pub struct TaskHandle {
    pub(crate) control: &'static ControlBlock,
    /// Of its stack.
    pub(crate) bytes: usize,
}

/// Why a task can't be suspended or killed now.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Refused {
    /// No task runs on that stack.
    NotStarted,
    /// It has a mutex, or waits for one; or another task is just killing it or changing its priority. Only of
    /// [`kill`](TaskHandle::kill): it waits for several semaphores or runs jobs.
    Busy,
}

/// What a task does.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum TaskState {
    /// No task runs on that stack.
    NotStarted,
    /// It runs, or would if no other did.
    Ready,
    /// It waits for a semaphore, a time or one of several things.
    Waiting,
    /// It is suspended.
    Suspended,
}

const SUSPEND: Suspension = Suspension { unless: Flag::Locks as u8 | Flag::Held as u8, flag: 0 };
/// To be given another priority.
const HOLD: Suspension = Suspension { flag: Flag::Held as u8, ..SUSPEND };
const KILL: Suspension = Suspension { unless: SUSPEND.unless | Flag::Represented as u8, ..HOLD };

impl TaskHandle {
    /// The size of its stack, in bytes.
    pub fn stack_size(self) -> usize {
        self.bytes
    }

    /// Keeps the task from running until it is resumed. What it waits for may come meanwhile. A task may suspend itself.
    ///
    /// Linear in the number of ready tasks, but interrupts are masked for a step at a time.
    ///
    /// # Errors
    /// [`Refused`], with nothing done.
    pub fn suspend(self, context: &mut impl ThreadContext) -> Result<(), Refused> {
        if let Some(task) = self.as_self(context) {
            ready::retire(task, ControlBlock::suspend);
            arch::switch_from_call();
            return Ok(());
        }
        self.take(context, SUSPEND).map(|_| ())
    }

    /// Lets the task run again. Returns whether it was suspended. Constant in time.
    pub fn resume(self, context: &mut impl Context) -> bool {
        loop {
            let (priority, above) = self.control.rank(context);
            let came = context.mask(|masked| {
                if !self.control.is_suspended(masked) || self.control.has_flag(masked, Flag::Held) {
                    return Some((false, false));
                }
                // Another task may have changed it meanwhile.
                let is_the_same = self.control.index(masked) == usize::from(priority);
                is_the_same.then(|| (true, self.release(masked, above)))
            });
            if let Some((was_suspended, is_due)) = came {
                context.reschedule(is_due);
                return was_suspended;
            }
        }
    }

    /// Gives the task another priority. Among those that wait for the same as it, it keeps its place. What stands in for it, where
    /// it waits for several semaphores or runs jobs, keeps the priority of before.
    ///
    /// # Errors
    /// [`Refused`], with nothing done.
    pub fn set_priority(self, context: &mut impl ThreadContext, priority: Priority) -> Result<(), Refused> {
        let above = priority.above();
        if let Some(task) = self.as_self(context) {
            ready::retire(task, |control, masked| {
                control.change_priority(masked, priority);
                control.above.set(masked, above);
                arch::make_ready(masked, control);
            });
            if task.mask(ready::is_due) {
                arch::switch_from_call();
            }
            return Ok(());
        }
        // One that is suspended is in no list that goes by priority.
        while self.take(context, HOLD)? == Found::Suspended {
            let is_changed = context.mask(|masked| {
                let is_suspended = self.control.is_suspended(masked);
                if is_suspended {
                    self.control.change_priority(masked, priority);
                }
                is_suspended
            });
            if is_changed {
                return Ok(());
            }
        }
        let is_due = context.mask(|masked| {
            self.control.change_priority(masked, priority);
            self.control.clear_flag(masked, Flag::Held);
            self.release(masked, above)
        });
        context.reschedule(is_due);
        Ok(())
    }

    /// Ends the task where it is; its stack can be started again. Nothing that it has is dropped: messages and other values of
    /// its own are lost for good, and what it was in the midst of stays half done. A task may kill itself.
    ///
    /// Linear in the number of ready tasks, of those that wait for the same, and of timers, in steps.
    ///
    /// # Errors
    /// [`Refused`], with nothing done.
    pub fn kill(self, context: &mut impl ThreadContext) -> Result<(), Refused> {
        if let Some(task) = self.as_self(context) {
            // In one of its jobs it is represented.
            if task.mask(|masked| self.control.has_flag(masked, Flag::Represented)) {
                return Err(Refused::Busy);
            }
            task.exit();
        }
        // One that was suspended may be resumed before it is held: it is searched again then.
        while self.take(context, KILL)? == Found::Suspended && !context.mask(|masked| self.hold(masked)) {}
        // Whatever wakes it from here on finds it suspended, and nobody resumes it.
        while let Some(semaphore) = list::awaited(context, self.control) {
            list::expel(context, semaphore, self.control, |masked| {
                self.control.link.set(masked, Link::PARKED);
            });
        }
        timer::disarm_within(context, arch::stack(self.control, self.bytes));
        context.mask(|masked| self.control.forget(masked));
        Ok(())
    }

    /// What the task does at the moment. Linear in the number of ready tasks, in steps.
    pub fn state(self, context: &mut impl ThreadContext) -> TaskState {
        match list::search(context, self.control, None) {
            Found::NotStarted => TaskState::NotStarted,
            Found::Suspended => TaskState::Suspended,
            Found::Ready => TaskState::Ready,
            Found::Waiting | Found::Refused => TaskState::Waiting,
        }
    }

    /// Its priority; `P0` before it is started.
    pub fn priority(self, context: &mut impl Context) -> Priority {
        context.mask(|masked| self.control.priority(masked))
    }

    /// Suspends the task as `suspension` says, unless it is.
    fn take(self, context: &mut impl ThreadContext, suspension: Suspension) -> Result<Found, Refused> {
        match list::search(context, self.control, Some(suspension)) {
            Found::NotStarted => Err(Refused::NotStarted),
            Found::Refused => Err(Refused::Busy),
            found => Ok(found),
        }
    }

    /// Holds the task, which was suspended, unless that has changed. Returns whether it did.
    fn hold(self, masked: &Masked) -> bool {
        let may = self.control.is_suspended(masked) && !self.control.has_any(masked, KILL.unless);
        if may {
            self.control.set_flag(masked, Flag::Held);
        }
        may
    }

    /// The task is not suspended any more. Returns whether it is now the one to run.
    #[inline(always)]
    fn release(self, masked: &Masked, above: u8) -> bool {
        self.control.above.set(masked, above);
        self.control.link.get(masked) == Link::PARKED && arch::make_ready(masked, self.control)
    }

    /// The task's own context, if it is the one that calls.
    pub(crate) fn as_self(self, context: &mut impl ThreadContext) -> Option<&mut Task> {
        let is_self = context.mask(|masked| ready::running(masked).is(self.control));
        context.task(Private).filter(|_| is_self)
    }
}

impl Task {
    /// Ends this task; its stack can be started again. Nothing that it has is dropped.
    pub fn exit(&mut self) -> Never {
        ready::retire(self, |control, masked| {
            control.forget(masked);
            arch::leave(masked)
        })
    }
}
