//! What one task does to another.

use crate::arch;
use crate::context::{Context, Private, Task, ThreadContext};
use crate::link::Link;
use crate::list::{Found, Suspension};
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

/// Not at all: only to be found.
const LOOK: Suspension = Suspension { unless: 0, flag: 0 };
const SUSPEND: Suspension = Suspension { unless: Flag::Locks as u8 | Flag::Held as u8, ..LOOK };
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
            task.mask(|masked| {
                let control = ready::retire(masked);
                control.suspend(masked);
                control.link.set(masked, Link::PARKED);
            });
            arch::switch_from_call();
            return Ok(());
        }
        self.take(context, SUSPEND, |_| {}).map(|_| ())
    }

    /// Lets the task run again. Returns whether it was suspended. Constant in time.
    pub fn resume(self, context: &mut impl Context) -> bool {
        let is_due = context.mask(|masked| arch::resume(masked, self.control));
        context.reschedule(is_due == Some(true));
        is_due.is_some()
    }

    /// Gives the task another priority. Among those that wait for the same as it, it keeps its place. What stands in for it, where
    /// it waits for several semaphores or runs jobs, keeps the priority of before.
    ///
    /// # Errors
    /// [`Refused`], with nothing done.
    pub fn set_priority(self, context: &mut impl ThreadContext, priority: Priority) -> Result<(), Refused> {
        let above = arch::worked_out(priority.above());
        let is_due = if let Some(task) = self.as_self(context) {
            task.mask(|masked| {
                let control = ready::retire(masked);
                control.change_priority(masked, priority);
                control.above.set(masked, above);
                arch::make_ready(masked, control);
            });
            true
        } else {
            // One that is suspended is in no list that goes by priority.
            let found = self.take(context, HOLD, |masked| self.control.change_priority(masked, priority))?;
            found != Found::Suspended
                && context.mask(|masked| arch::release(masked, self.control, priority, above))
        };
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
        self.take(context, KILL, |masked| self.control.set_flag(masked, Flag::Held))?;
        // Whatever wakes it from here on finds it suspended, and nobody resumes it.
        arch::withdraw(context, self.control);
        timer::disarm_within(context, arch::stack(self.control, self.bytes));
        context.mask(|masked| self.control.forget(masked));
        Ok(())
    }

    /// What the task does at the moment. Linear in the number of ready tasks, in steps.
    pub fn state(self, context: &mut impl ThreadContext) -> TaskState {
        match arch::search(context, self.control, LOOK, |_, found| found) {
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

    /// Suspends the task as `suspension` says. If it is suspended already, does `instead` in the masked section that shows it.
    fn take(
        self,
        context: &mut impl ThreadContext,
        suspension: Suspension,
        instead: impl Fn(&Masked),
    ) -> Result<Found, Refused> {
        let found = arch::search(context, self.control, suspension, |masked, found| {
            if found == Found::Suspended {
                instead(masked);
            }
            found
        });
        match found {
            Found::NotStarted => Err(Refused::NotStarted),
            Found::Refused => Err(Refused::Busy),
            found => Ok(found),
        }
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
        self.mask(|masked| {
            ready::retire(masked).forget(masked);
            arch::leave(masked)
        })
    }
}
