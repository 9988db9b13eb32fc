//! What tasks do to tasks, and to themselves.

use std::mem;

use kernel::{Priority, Refused, TaskState};

use super::{Activity, Reference, TaskId};
use crate::call::Outcome;

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

    /// `id`, which runs, suspends `task`.
    pub(super) fn suspend(&mut self, id: TaskId, task: TaskId) -> Outcome {
        if let Some(refused) = self.refuses(id, task) {
            return Outcome::Refused(refused);
        }
        self.tasks[task].is_suspended = true;
        self.ready.retain(|&other| other != task);
        Outcome::Nothing
    }

    /// Returns whether the task was suspended. What it waited for may have come meanwhile.
    pub(super) fn resume(&mut self, id: TaskId) -> bool {
        let was_suspended = !self.tasks[id].is_held && mem::take(&mut self.tasks[id].is_suspended);
        if was_suspended && !matches!(self.tasks[id].activity, Activity::Blocked(_) | Activity::Gone) {
            self.make_ready(id);
        }
        was_suspended
    }

    /// `id`, which runs, gives `task` another priority. A task that waits keeps its place.
    pub(super) fn set_priority(&mut self, id: TaskId, task: TaskId, priority: Priority) -> Outcome {
        if let Some(refused) = self.refuses(id, task) {
            return Outcome::Refused(refused);
        }
        self.tasks[task].priority = priority;
        if self.ready.contains(&task) {
            self.make_ready(task);
        }
        Outcome::Nothing
    }

    /// `id`, which runs, is to give another task, which is not suspended, another priority: until then that does not run.
    /// Returns whether it may.
    pub(super) fn begin_to_set_priority(&mut self, id: TaskId, task: TaskId, priority: Priority) -> bool {
        let may = self.refuses(id, task).is_none() && !self.tasks[task].is_suspended && task != id;
        if may {
            self.suspend(id, task);
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

    /// `id`, which runs, ends another task. The messages that this has are lost.
    pub(super) fn kill(&mut self, id: TaskId, task: TaskId) -> Outcome {
        match self.refuses(id, task) {
            Some(refused) => Outcome::Refused(refused),
            None => {
                self.end_task(task);
                Outcome::Nothing
            }
        }
    }

    /// `id`, which runs, is to end another task: nobody resumes that any more. Returns whether it may.
    pub(super) fn begin_to_kill(&mut self, id: TaskId, task: TaskId) -> bool {
        let may = self.refuses(id, task).is_none() && task != id;
        if may {
            self.suspend(id, task);
            self.tasks[task].is_held = true;
            self.tasks[id].activity = Activity::Killing { task };
        }
        may
    }

    pub(super) fn end_task(&mut self, id: TaskId) {
        self.ready.retain(|&other| other != id);
        self.lines.retain(|&(_, other)| other != id);
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

    /// Why `task` is left alone by `id`, if it is.
    fn refuses(&self, id: TaskId, task: TaskId) -> Option<Refused> {
        let other = &self.tasks[task];
        match other.activity {
            Activity::New => Some(Refused::NotStarted),
            _ if (other.locks || other.is_held) && id != task => Some(Refused::Busy),
            _ => None,
        }
    }
}
