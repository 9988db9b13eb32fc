//! What one task does to another.

use crate::arch;
use crate::context::{Context, Private, Task, ThreadContext};
use crate::link::Link;
use crate::list::{self, Found};
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
    /// It has a mutex, or waits for one. Only of [`kill`](TaskHandle::kill): it waits for several semaphores or runs jobs, or
    /// another task kills or resumes it.
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

impl TaskHandle {
    /// Keeps the task from running until it is resumed. What it waits for may come meanwhile. A task may suspend itself.
    ///
    /// Linear in the number of ready tasks, but interrupts are masked for a step at a time.
    ///
    /// # Errors
    /// [`Refused`], with nothing done.
    pub fn suspend(self, context: &mut impl ThreadContext) -> Result<(), Refused> {
        if !context.mask(|masked| self.is_started(masked)) {
            return Err(Refused::NotStarted);
        }
        if let Some(task) = self.as_self(context) {
            ready::retire(task, ControlBlock::suspend);
            arch::switch_from_call();
            return Ok(());
        }
        match list::search(context, self.control, true) {
            Found::Locks => Err(Refused::Busy),
            _ => Ok(()),
        }
    }

    /// Lets the task run again. Returns whether it was suspended. Constant in time.
    pub fn resume(self, context: &mut impl Context) -> bool {
        let above = self.control.above_priority(context);
        let (was_suspended, is_due) = context.mask(|masked| {
            let control = self.control;
            if !control.is_suspended(masked) || control.has_flag(masked, Flag::Dies) {
                return (false, false);
            }
            control.above.set(masked, above);
            let is_parked = control.link.get(masked) == Link::PARKED;
            (true, is_parked && ready::make_ready(masked, control))
        });
        context.reschedule(is_due);
        was_suspended
    }

    /// Gives the task another priority. Among those that wait for the same as it, it keeps its place.
    ///
    /// # Errors
    /// [`Refused`], with nothing done.
    pub fn set_priority(self, context: &mut impl ThreadContext, priority: Priority) -> Result<(), Refused> {
        if let Some(task) = self.as_self(context) {
            ready::retire(task, |control, masked| {
                control.change_priority(masked, priority);
                control.above.set(masked, priority.above());
                ready::make_ready(masked, control);
            });
            if task.mask(ready::is_due) {
                arch::switch_from_call();
            }
            return Ok(());
        }
        let was_suspended = context.mask(|masked| self.control.is_suspended(masked));
        self.suspend(context)?;
        context.mask(|masked| self.control.change_priority(masked, priority));
        if !was_suspended {
            self.resume(context);
        }
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
            task.exit();
        }
        if context.mask(|masked| self.control.has_flag(masked, Flag::Represented)) {
            return Err(Refused::Busy);
        }
        self.suspend(context)?;
        // Whatever wakes it from here on finds it suspended, and nobody resumes it.
        if !context.mask(|masked| self.control.begin_to_die(masked)) {
            return Err(Refused::Busy);
        }
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
        let (is_started, is_suspended) =
            context.mask(|masked| (self.is_started(masked), self.control.is_suspended(masked)));
        match (is_started, is_suspended) {
            (false, _) => TaskState::NotStarted,
            (_, true) => TaskState::Suspended,
            _ if list::search(context, self.control, false) == Found::Ready => TaskState::Ready,
            _ => TaskState::Waiting,
        }
    }

    /// Its priority; `P0` before it is started.
    pub fn priority(self, context: &mut impl Context) -> Priority {
        context.mask(|masked| self.control.priority(masked))
    }

    pub(crate) fn is_started(self, masked: &Masked) -> bool {
        self.control.stack_pointer.get(masked) != 0
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
