//! Task control: what one task can do to another.

use crate::arch;
use crate::context::{Context, Never, Private, Task, ThreadContext};
use crate::control_block::{ControlBlock, Flag, Priority};
use crate::critical::{Masked, MaskedCell};
use crate::link::Link;
use crate::ready::{self, Cursor, Progress};
use crate::timer;
use crate::traversal;
use crate::wait;
use crate::wait_set::WaitSet;

/// A handle of a task, for other tasks: see [`Stack::task`](crate::Stack::task).
#[derive(Clone, Copy)]
pub struct TaskHandle {
    pub(crate) control: &'static ControlBlock,
    /// The size of its stack.
    pub(crate) bytes: usize,
}

/// Why a task can't be suspended, killed or given another priority now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// No task runs on that stack, or it was killed.
    NotStarted,
    /// The task holds a mutex, or waits for one. [`kill`](TaskHandle::kill) also refuses a task that runs
    /// jobs, starts or kills a task, or is entering or leaving a wait with a timeout or for several
    /// semaphores.
    Busy,
}

/// The state of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskState {
    /// No task runs on that stack.
    NotStarted,
    /// It runs, or would run if no other task did.
    Ready,
    /// It waits for a semaphore, a time or one of several things.
    Waiting,
    /// It is suspended.
    Suspended,
    /// It was killed. Its stack stays as it is until [`reuse`](TaskHandle::reuse).
    Killed,
}

/// What a search does to the task when it has found it.
#[derive(Clone, Copy)]
enum Action<'a> {
    Look,
    Suspend,
    /// Stores the wait set that the task is blocked on here.
    Kill(&'a MaskedCell<Option<&'static WaitSet>>),
    SetPriority(Priority),
}

impl TaskHandle {
    /// The size of its stack, in bytes.
    pub fn stack_size(self) -> usize {
        self.bytes
    }

    /// Keeps the task from running until it is resumed. What it waits for may come meanwhile. A task may
    /// suspend itself. If a task is suspended for more than [`LONGEST`](crate::LONGEST) ticks while it begins
    /// a delay or a wait with a timeout, or while it continues such a wait for flags, it may wait that long
    /// again.
    ///
    /// Linear in the number of ready tasks of its priority, preemptible between steps.
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

    /// Lets the task run again. Returns whether it was suspended. Constant time.
    pub fn resume(self, context: &mut impl Context) -> bool {
        let is_due = context.mask(|masked| {
            let control = self.control;
            let is_suspended = control.is_halted(masked) && !control.has_flag(masked, Flag::Killed);
            is_suspended.then(|| {
                control.level.set(masked, control.base(masked));
                traversal::end(masked); // the task may be in the middle of an older one
                control.link.get(masked) == Link::PARKED && ready::wake(masked, control)
            })
        });
        context.reschedule(is_due == Some(true));
        is_due.is_some()
    }

    /// Gives the task another priority. A ready task goes behind the others of its new priority. In a wait
    /// queue a task keeps its place. If it waits for several semaphores or with a timeout, or runs jobs, its
    /// proxy waiters keep the old priority.
    ///
    /// Linear in the number of ready tasks of its priority, preemptible between steps.
    ///
    /// # Errors
    /// [`Refused`], with nothing done.
    pub fn set_priority(self, context: &mut impl ThreadContext, priority: Priority) -> Result<(), Refused> {
        self.find(context, Action::SetPriority(priority))?;
        let is_due = context.mask(ready::is_due);
        context.reschedule(is_due);
        Ok(())
    }

    /// Ends the task where it is. Nothing that it owns is dropped: its messages and other values are lost for
    /// good, and what it was doing stays half done. Its stack stays as it is, because values there may be
    /// pinned, or lent to a device: see [`reuse`](Self::reuse). A task may kill itself. A signal that has
    /// woken it, and on which it has not acted yet, is lost: a queue stays one message behind then, and a
    /// pipe one byte, or it has one place less.
    ///
    /// Linear in the number of ready tasks of its priority, of tasks that wait for the same object, and of
    /// armed timers, preemptible between steps.
    ///
    /// # Errors
    /// [`Refused`], with nothing done.
    pub fn kill(self, context: &mut impl ThreadContext) -> Result<(), Refused> {
        if let Some(task) = self.as_self(context) {
            if task.mask(|masked| self.control.has_any(masked, UNKILLABLE | Flag::Proxied as u8)) {
                return Err(Refused::Busy);
            }
            task.exit();
        }
        let guard = KillGuard::begin(context);
        let wait_set = MaskedCell::new(None);
        let found = self.find_unless(context, UNKILLABLE, Action::Kill(&wait_set));
        if found.is_ok() {
            wait::withdraw(context, self.control);
            timer::disarm_all_of(context, self.control);
            let proxies = |masked: &Masked| wait_set.get(masked).map_or(&[][..], |set| set.proxies(masked));
            for proxy in context.mask(proxies) {
                proxy.word.expel(context, &proxy.control);
            }
        }
        guard.end(context);
        found.map(|_| ())
    }

    /// Frees the stack of a task that was killed, so that it can be started again. Returns whether it did. It
    /// does not if the task has killed itself and is still the running one, before the switch.
    ///
    /// # Safety
    /// The call that killed the task must have returned, and nothing on its stack may be in use any more: no
    /// value that is pinned there, and nothing that a device or an interrupt handler reads or writes. The
    /// kernel itself uses nothing there.
    ///
    /// ```compile_fail,E0133
    /// # use kernel::{Task, TaskHandle};
    /// fn restart(task: &mut Task, killed: TaskHandle) {
    ///     killed.reuse(task); // error: call to unsafe function requires an unsafe block
    /// }
    /// ```
    pub unsafe fn reuse(self, context: &mut impl Context) -> bool {
        context.mask(|masked| {
            // A task that ends itself is the running one until the switch.
            let is_over = !ready::running(masked).is(self.control);
            let is_killed = self.control.has_flag(masked, Flag::Killed) && is_over;
            if is_killed {
                self.control.free(masked);
            }
            is_killed
        })
    }

    /// The task's present state. Linear in the number of ready tasks of its priority, preemptible between
    /// steps.
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

    /// Finds the task, unless it has one of these [`Flag`]s, and acts on it in the critical section that
    /// finds it.
    #[inline(never)]
    fn find_unless(
        self,
        context: &mut impl ThreadContext,
        flags: u8,
        action: Action,
    ) -> Result<TaskState, Refused> {
        let control = self.control;
        let mut cursor = Cursor::new();
        traversal::make(context, |masked| {
            // Once per traversal: any change of this invalidates it.
            if cursor.is_at_start(masked) {
                if !control.is_started(masked) || control.has_flag(masked, Flag::Killed) {
                    return Some(Err(Refused::NotStarted));
                }
                if control.has_any(masked, flags) {
                    return Some(Err(Refused::Busy));
                }
                if control.is_halted(masked) {
                    return Some(self.act(masked, TaskState::Suspended, &cursor, action));
                }
            }
            let state = match cursor.step(masked, control) {
                Progress::More => return None,
                Progress::Absent => TaskState::Waiting,
                Progress::Ready => TaskState::Ready,
            };
            Some(self.act(masked, state, &cursor, action))
        })
    }

    /// Acts on the task, which the search has found in that state.
    #[inline(never)]
    fn act(
        self,
        masked: &Masked,
        state: TaskState,
        cursor: &Cursor,
        action: Action,
    ) -> Result<TaskState, Refused> {
        let control = self.control;
        if let Action::Kill(wait_set) = action
            && control.has_flag(masked, Flag::Proxied)
        {
            let set = control.link.get(masked).wait_set(masked, control);
            wait_set.set(masked, set.filter(|set| !set.proxies(masked).is_empty()));
            if wait_set.get(masked).is_none() {
                return Err(Refused::Busy);
            }
        }
        let is_ready = state == TaskState::Ready;
        if is_ready && !matches!(action, Action::Look) {
            cursor.remove(masked, control);
            control.link.set(masked, Link::PARKED);
        }
        match action {
            Action::Look => {}
            Action::Suspend | Action::Kill(_) => {
                if matches!(action, Action::Kill(_)) {
                    control.set_flag(masked, Flag::Killed);
                }
                control.halt(masked);
            }
            Action::SetPriority(priority) => {
                control.set_priority(masked, priority);
                if is_ready {
                    ready::wake(masked, control);
                }
            }
        }
        Ok(state)
    }

    /// The task's own context, if this task is the caller.
    pub(crate) fn as_self(self, context: &mut impl ThreadContext) -> Option<&mut Task> {
        let is_self = context.mask(|masked| ready::running(masked).is(self.control));
        context.task(Private).filter(|_| is_self)
    }
}

/// The [`Flag`]s of a task that can't be killed.
const UNKILLABLE: u8 = Flag::Locks as u8 | Flag::Unkillable as u8;

/// Keeps a task that starts or kills another from being killed meanwhile.
pub(crate) struct KillGuard {
    /// Whether the caller is a task, and could be killed before.
    was_killable: bool,
}

impl KillGuard {
    pub(crate) fn begin(context: &mut impl Context) -> KillGuard {
        let is_task = context.task(Private).is_some();
        let was_killable = is_task
            && context.mask(|masked| {
                let own = ready::running(masked);
                let was_killable = !own.has_flag(masked, Flag::Unkillable);
                own.set_flag(masked, Flag::Unkillable);
                was_killable
            });
        KillGuard { was_killable }
    }

    pub(crate) fn end(self, context: &mut impl Context) {
        if self.was_killable {
            context.mask(|masked| ready::running(masked).clear_flag(masked, Flag::Unkillable));
        }
    }
}

impl Task {
    /// Ends this task where it is, as [`TaskHandle::kill`] does. A body that returns ends its task, too; only
    /// in that case is the stack free for another task.
    pub fn exit(&mut self) -> Never {
        self.mask(|masked| {
            let own = ready::leave(masked);
            own.halt(masked);
            own.set_flag(masked, Flag::Killed);
            own.link.set(masked, Link::PARKED);
        });
        ready::dispatch(self);
        self.mask(|masked| arch::run_head(masked))
    }
}
