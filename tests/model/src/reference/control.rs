//! The calls by which tasks control tasks.

use std::mem;

use kernel::{Priority, Refused, TaskState};

use super::{Activity, Reference, TaskId, Waiter};

impl Reference {
    /// Starts a task. Returns whether it was new, or had ended.
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

    /// Suspends `task`, for task `id`, or for the code that starts the tasks if `id` is `None`.
    pub(super) fn suspend(&mut self, id: Option<TaskId>, task: TaskId) -> Result<(), Refused> {
        self.may_change(id, task)?;
        self.tasks[task].is_suspended = true;
        self.ready.retain(|&other| other != task);
        Ok(())
    }

    /// Resumes a task. Returns whether it was suspended. Its wait may have ended meanwhile.
    pub(super) fn resume(&mut self, id: TaskId) -> bool {
        let was_suspended = mem::take(&mut self.tasks[id].is_suspended);
        if was_suspended && !matches!(self.tasks[id].activity, Activity::Blocked(_) | Activity::Gone) {
            self.make_ready(id);
        }
        was_suspended
    }

    /// Gives `task` another priority, for `id` as in [`suspend`](Self::suspend). A task that waits keeps its
    /// place.
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

    pub(super) fn state(&self, id: TaskId) -> TaskState {
        match self.tasks[id].activity {
            Activity::New | Activity::Dying => TaskState::NotStarted,
            _ if self.tasks[id].is_suspended => TaskState::Suspended,
            _ if self.ready.contains(&id) => TaskState::Ready,
            _ => TaskState::Waiting,
        }
    }

    /// Ends another task, for `id` as in [`suspend`](Self::suspend). The messages of the ended task are lost.
    pub(super) fn kill(&mut self, id: Option<TaskId>, task: TaskId) -> Result<(), Refused> {
        self.may_kill(id, task)?;
        self.end_task(task, Activity::New);
        Ok(())
    }

    /// The running task `id` ends another task, which can be started when the call is over.
    pub(super) fn begin_to_kill(&mut self, id: TaskId, task: TaskId) -> Result<(), Refused> {
        self.may_kill(Some(id), task)?;
        let place = self.lines.iter().position(|&(_, waiter)| waiter == Waiter::Task(task));
        let waited = place.map(|place| (place, self.lines[place].0));
        self.end_task(task, Activity::Dying);
        // Until it has left its line, a signal passes it over.
        if let Some((place, object)) = waited {
            self.tasks[task].line_priority = self.tasks[task].priority;
            self.lines.insert(place.min(self.lines.len()), (object, Waiter::Void(task)));
        }
        self.tasks[id].is_unkillable = true;
        self.tasks[id].activity = Activity::Ending { task };
        Ok(())
    }

    pub(super) fn leave_line(&mut self, id: TaskId) {
        self.lines.retain(|&(_, waiter)| waiter != Waiter::Task(id));
    }

    /// Ends the wait of `id`. It remains in its line until it leaves the line, or a signal passes it over.
    pub(super) fn void_line(&mut self, id: TaskId) {
        for (_, waiter) in &mut self.lines {
            if *waiter == Waiter::Task(id) {
                *waiter = Waiter::Void(id);
            }
        }
    }

    pub(super) fn end_task(&mut self, id: TaskId, activity: Activity) {
        self.ready.retain(|&other| other != id);
        self.leave_line(id);
        let is_its = |waiter| matches!(waiter, Waiter::Member(other, _) | Waiter::Void(other) if other == id);
        self.lines.retain(|&(_, waiter)| !is_its(waiter));
        self.cancel_end(id);
        let task = &mut self.tasks[id];
        task.activity = activity;
        task.group = None;
        task.is_suspended = false;
        task.is_unkillable = false;
        task.is_proxied = false;
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
            Activity::New | Activity::Dying => Err(Refused::NotStarted),
            _ if other.locks && id != Some(task) => Err(Refused::Busy),
            _ => Ok(()),
        }
    }

    /// Whether `task` may be killed. In a wait by proxy waiters it may only while it is blocked.
    fn may_kill(&self, id: Option<TaskId>, task: TaskId) -> Result<(), Refused> {
        self.may_change(id, task)?;
        let other = &self.tasks[task];
        let is_by_proxy = other.is_proxied || other.group.is_some();
        let is_blocked = matches!(other.activity, Activity::Blocked(call)
            if call.timeout().is_some() || call.several().is_some());
        let may = !other.is_unkillable && (!is_by_proxy || is_blocked);
        if may { Ok(()) } else { Err(Refused::Busy) }
    }
}
