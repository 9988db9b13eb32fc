//! What tasks do to tasks, and to themselves.

use std::mem;

use kernel::{Priority, Refused, TaskState};

use super::{Activity, Reference, TaskId, Waiter};

impl Reference {
    /// Returns whether the task was new, or had ended.
    pub(super) fn start(&mut self, id: TaskId) -> bool {
        let task = &mut self.tasks[id];
        let is_new = task.activity == Activity::New;
        if is_new {
            task.activity = Activity::Own;
            task.priority = task.first_priority;
            self.make_ready(id);
        }
        is_new
    }

    /// Suspends `task`: task `id` if that runs, or who starts them all.
    pub(super) fn suspend(&mut self, id: Option<TaskId>, task: TaskId) -> Result<(), Refused> {
        self.may_change(id, task)?;
        self.tasks[task].is_suspended = true;
        self.ready.retain(|&other| other != task);
        Ok(())
    }

    /// Returns whether the task was suspended. What it waited for may have come meanwhile.
    pub(super) fn resume(&mut self, id: TaskId) -> bool {
        let was_suspended = !self.tasks[id].is_held && mem::take(&mut self.tasks[id].is_suspended);
        if was_suspended && !matches!(self.tasks[id].activity, Activity::Blocked(_) | Activity::Gone) {
            self.make_ready(id);
        }
        was_suspended
    }

    /// Gives `task` another priority, likewise. One that waits keeps its place.
    pub(super) fn set_priority(
        &mut self,
        id: Option<TaskId>,
        task: TaskId,
        priority: Priority,
    ) -> Result<(), Refused> {
        self.may_change(id, task)?;
        self.tasks[task].priority = priority;
        if self.ready.contains(&task) {
            self.make_ready(task);
        }
        Ok(())
    }

    /// `id`, which runs, is to give another task, which is not suspended, another priority: until then that does not run.
    /// Returns whether it may.
    pub(super) fn begin_to_set_priority(&mut self, id: TaskId, task: TaskId, priority: Priority) -> bool {
        let may = !self.tasks[task].is_suspended && task != id && self.suspend(Some(id), task).is_ok();
        if may {
            self.tasks[task].is_held = true;
            self.tasks[id].activity = Activity::SettingPriority { task, priority };
        }
        may
    }

    pub(super) fn release(&mut self, id: TaskId, priority: Priority) {
        self.tasks[id].priority = priority;
        self.tasks[id].is_held = false;
        self.resume(id);
    }

    pub(super) fn state(&self, id: TaskId) -> TaskState {
        match self.tasks[id].activity {
            Activity::New => TaskState::NotStarted,
            _ if self.tasks[id].is_suspended => TaskState::Suspended,
            _ if self.ready.contains(&id) => TaskState::Ready,
            _ => TaskState::Waiting,
        }
    }

    /// Ends another task, likewise. The messages that this has are lost.
    pub(super) fn kill(&mut self, id: Option<TaskId>, task: TaskId) -> Result<(), Refused> {
        self.may_kill(id, task)?;
        self.end_task(task);
        Ok(())
    }

    /// `id`, which runs, is to end another task: nobody resumes that any more.
    pub(super) fn begin_to_kill(&mut self, id: TaskId, task: TaskId) -> Result<(), Refused> {
        self.may_kill(Some(id), task)?;
        self.suspend(Some(id), task)?;
        self.tasks[task].is_held = true;
        self.tasks[id].activity = Activity::Killing { task };
        Ok(())
    }

    pub(super) fn leave_line(&mut self, id: TaskId) {
        self.lines.retain(|&(_, waiter)| waiter != Waiter::Task(id));
    }

    pub(super) fn end_task(&mut self, id: TaskId) {
        self.ready.retain(|&other| other != id);
        self.leave_line(id);
        self.cancel_end(id);
        let task = &mut self.tasks[id];
        task.activity = Activity::New;
        task.is_suspended = false;
        task.is_held = false;
        task.locks = false;
        task.clock = None;
        task.made = None;
        task.received = 0;
        task.period = None;
    }

    /// Whether `task` may be suspended or changed.
    fn may_change(&self, id: Option<TaskId>, task: TaskId) -> Result<(), Refused> {
        let other = &self.tasks[task];
        match other.activity {
            Activity::New => Err(Refused::NotStarted),
            _ if (other.locks || other.is_held) && id != Some(task) => Err(Refused::Busy),
            _ => Ok(()),
        }
    }

    fn may_kill(&self, id: Option<TaskId>, task: TaskId) -> Result<(), Refused> {
        self.may_change(id, task)?;
        if self.tasks[task].group.is_some() { Err(Refused::Busy) } else { Ok(()) }
    }
}
