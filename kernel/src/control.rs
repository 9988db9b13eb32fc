//! What one task does to another.

use crate::arch;
use crate::context::{Context, Private, Task, ThreadContext};
use crate::control_block::{ControlBlock, Flag, HALTED, Priority};
use crate::critical::Masked;
use crate::link::Link;
use crate::ready::{self, Cursor, Progress};
use crate::task::Never;
use crate::traversal;
use crate::wait;

/// A task, to others: see [`Stack::task`](crate::Stack::task).
#[derive(Clone, Copy)]
pub struct TaskHandle {
    pub(crate) control: &'static ControlBlock,
    /// Of its stack.
    pub(crate) bytes: usize,
}

/// Why a task can't be suspended or killed now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// No task runs on that stack, or it was killed.
    NotStarted,
    /// It has a mutex, or waits for one. Only of [`kill`](TaskHandle::kill): it waits for several semaphores, runs jobs, or
    /// starts a task.
    Busy,
}

/// What a task does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskState {
    /// No task runs on that stack.
    NotStarted,
    /// It runs, or would if no other did.
    Ready,
    /// It waits for a semaphore, a time or one of several things.
    Waiting,
    /// It is suspended.
    Suspended,
    /// It was killed. Its stack stays as it is until [`reuse`](TaskHandle::reuse).
    Killed,
}

/// What is done to a task where it is found.
#[derive(Clone, Copy)]
enum Action {
    Look,
    Suspend,
    SetPriority(Priority),
}

impl TaskHandle {
    /// The size of its stack, in bytes.
    pub fn stack_size(self) -> usize {
        self.bytes
    }

    /// Keeps the task from running until it is resumed. What it waits for may come meanwhile. A task may suspend itself.
    ///
    /// Linear in the number of ready tasks of its priority, in steps.
    ///
    /// # Errors
    /// [`Refused`], with nothing done.
    pub fn suspend(self, context: &mut impl ThreadContext) -> Result<(), Refused> {
        if let Some(task) = self.as_self(context) {
            let may = task.mask(|masked| {
                let may = !self.control.has_flag(masked, Flag::Locks);
                if may {
                    ready::leave(masked).halt(masked);
                    self.control.link.set(masked, Link::PARKED);
                }
                may
            });
            if !may {
                return Err(Refused::Busy);
            }
            ready::dispatch(task);
            arch::switch_from_call(task);
            return Ok(());
        }
        self.find(context, Action::Suspend).map(|_| ())
    }

    /// Lets the task run again. Returns whether it was suspended. Constant in time.
    pub fn resume(self, context: &mut impl Context) -> bool {
        let is_due = context.mask(|masked| {
            let control = self.control;
            let is_suspended = control.is_halted(masked) && !control.has_flag(masked, Flag::Killed);
            is_suspended.then(|| {
                control.level.set(masked, control.base(masked));
                control.link.get(masked) == Link::PARKED && ready::wake(masked, control)
            })
        });
        context.reschedule(is_due == Some(true));
        is_due.is_some()
    }

    /// Gives the task another priority; among tasks that are ready it comes last then. In a wait queue it keeps its place.
    /// Its proxy waiters, where it waits for several semaphores or runs jobs, keep the priority of before.
    ///
    /// Linear in the number of ready tasks of its priority, in steps.
    ///
    /// # Errors
    /// [`Refused`], with nothing done.
    pub fn set_priority(self, context: &mut impl ThreadContext, priority: Priority) -> Result<(), Refused> {
        self.find(context, Action::SetPriority(priority))?;
        let is_due = context.mask(ready::is_due);
        context.reschedule(is_due);
        Ok(())
    }

    /// Ends the task where it is. Nothing that it has is dropped: messages and other values of its own are lost for good, and
    /// what it was in the midst of stays half done. Its stack stays as it is, for what it holds may be pinned, or
    /// lent to a device: see [`reuse`](Self::reuse). A task may kill itself.
    ///
    /// Linear in the number of ready tasks of its priority, and of those that wait for the same, in steps.
    ///
    /// # Errors
    /// [`Refused`], with nothing done.
    pub fn kill(self, context: &mut impl ThreadContext) -> Result<(), Refused> {
        if let Some(task) = self.as_self(context) {
            if task.mask(|masked| self.control.has_any(masked, UNKILLABLE)) {
                return Err(Refused::Busy);
            }
            task.exit();
        }
        let control = self.control;
        loop {
            // While it is halted it only moves where an ISR wakes it. Another task may let it run again meanwhile.
            self.find_unless(context, UNKILLABLE, Action::Suspend)?;
            let is_halted = |masked: &Masked| control.is_halted(masked);
            let mark = |masked: &Masked| {
                control.set_flag(masked, Flag::Killed);
                control.link.set(masked, Link::PARKED);
            };
            let is_killed = wait::withdraw(context, control, is_halted, mark)
                || context.mask(|masked| {
                    let link = control.link.get(masked);
                    let may = is_halted(masked) && (link == Link::PARKED || link == Link::DELAYED);
                    if may {
                        mark(masked);
                    }
                    may
                });
            if is_killed {
                return Ok(());
            }
        }
    }

    /// Frees the stack of a task that was killed, so that it can be started again. Returns whether it was.
    ///
    /// # Safety
    /// Nothing on the stack may be in use any more: no value that is pinned there, nothing that a device or an interrupt
    /// handler reads or writes, no timer that was armed by a wait with a timeout or a delay, and no proxy waiter of such a
    /// wait. A wait with a timeout that was killed has left its semaphore once that was posted.
    pub unsafe fn reuse(self, context: &mut impl ThreadContext) -> bool {
        context.mask(|masked| {
            let is_killed = self.control.has_flag(masked, Flag::Killed);
            if is_killed {
                self.control.free(masked);
            }
            is_killed
        })
    }

    /// What the task does at the moment. Linear in the number of ready tasks of its priority, in steps.
    pub fn state(self, context: &mut impl ThreadContext) -> TaskState {
        match self.find_unless(context, 0, Action::Look) {
            Ok(state) => state,
            Err(_) if context.mask(|masked| self.control.has_flag(masked, Flag::Killed)) => TaskState::Killed,
            Err(_) => TaskState::NotStarted,
        }
    }

    /// Its priority; `P0` before it is started.
    pub fn priority(self, context: &mut impl Context) -> Priority {
        context.mask(|masked| self.control.priority(masked))
    }

    /// Finds the task, unless it has a mutex or waits for one, and acts on it.
    fn find(self, context: &mut impl ThreadContext, action: Action) -> Result<TaskState, Refused> {
        self.find_unless(context, Flag::Locks as u8, action)
    }

    /// Finds the task, unless it has one of these [`Flag`]s, and acts on it in the critical section that finds it. Returns the
    /// state that it was in.
    #[inline(never)]
    fn find_unless(
        self,
        context: &mut impl ThreadContext,
        flags: u8,
        action: Action,
    ) -> Result<TaskState, Refused> {
        let mut cursor = Cursor::new();
        loop {
            let step = context.mask(|masked| {
                // Once in a traversal: what changes this invalidates it.
                if cursor.is_at_start(masked)
                    && let Some(found) = self.find_at_once(masked, flags, action)
                {
                    return Some(found);
                }
                let is_ready = match cursor.step(masked, self.control) {
                    Progress::More => return None,
                    Progress::Absent => false,
                    Progress::Ready => true,
                };
                traversal::end(masked);
                self.act(masked, is_ready.then_some(&cursor), action);
                Some(Ok(if is_ready { TaskState::Ready } else { TaskState::Waiting }))
            });
            if let Some(found) = step {
                return found;
            }
        }
    }

    /// Whether the task is where no search is needed.
    fn find_at_once(
        self,
        masked: &Masked,
        flags: u8,
        action: Action,
    ) -> Option<Result<TaskState, Refused>> {
        let control = self.control;
        if !control.is_started(masked) || control.has_flag(masked, Flag::Killed) {
            return Some(Err(Refused::NotStarted));
        }
        if control.has_any(masked, flags) {
            return Some(Err(Refused::Busy));
        }
        control.is_halted(masked).then(|| {
            self.act(masked, None, action);
            Ok(TaskState::Suspended)
        })
    }

    /// Acts on the task, which `ready` has found if it is ready.
    fn act(self, masked: &Masked, ready: Option<&Cursor>, action: Action) {
        let control = self.control;
        if let (Some(cursor), Action::Suspend | Action::SetPriority(_)) = (ready, action) {
            cursor.remove(masked, control);
            control.link.set(masked, Link::PARKED);
        }
        match action {
            Action::Look => {}
            Action::Suspend => control.halt(masked),
            Action::SetPriority(priority) => {
                control.set_priority(masked, priority);
                if ready.is_some() {
                    ready::wake(masked, control);
                }
            }
        }
    }

    /// The task's own context, if it is the one that calls.
    pub(crate) fn as_self(self, context: &mut impl ThreadContext) -> Option<&mut Task> {
        let is_self = context.mask(|masked| ready::running(masked).is(self.control));
        context.task(Private).filter(|_| is_self)
    }
}

/// Those of [`Flag`] with which a task is not killed.
const UNKILLABLE: u8 = Flag::Locks as u8 | Flag::Unkillable as u8;

impl Task {
    /// Ends this task where it is, as [`TaskHandle::kill`] does. A body that returns ends its task, too; only then the stack
    /// is free for another one.
    pub fn exit(&mut self) -> Never {
        self.mask(|masked| {
            let task = ready::leave(masked);
            task.level.set(masked, task.level.get(masked) | HALTED);
            task.set_flag(masked, Flag::Killed);
            task.link.set(masked, Link::PARKED);
            ready::update_head(masked);
            arch::run_head(masked)
        })
    }
}
