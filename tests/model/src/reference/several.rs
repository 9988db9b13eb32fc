//! Waits for several semaphores, and jobs: proxy waiters stand in line in place of a task.

use std::collections::VecDeque;
use std::ops::ControlFlow::{self, Break, Continue};

use kernel::Priority;

use super::{Activity, Reference, TaskId, Waiter};
use crate::call::{Call, Object, Outcome, SEVERAL};

/// The proxy waiters that stand in line in place of a task. A task with a group can't be killed.
#[derive(Clone, Default, PartialEq)]
pub struct Group {
    members: Vec<Member>,
    /// The members that have been given a signal, in the order of the signals.
    woken: VecDeque<usize>,
    /// Whether the time of the wait is up.
    is_over: bool,
}

#[derive(Clone, Copy, PartialEq)]
struct Member {
    semaphore: usize,
    job: Option<usize>,
    /// The task's priority when this member joined. The member waits in the queue with it.
    priority: Priority,
}

/// The next step of a wait for several semaphores, or before a job.
#[derive(Clone, Copy, PartialEq)]
pub enum Stage {
    /// Take a signal of the call's semaphore with this index.
    Try(usize),
    /// Read the clock, to see when the wait ends by itself.
    LookAtClock,
    /// Get a group.
    Gather,
    /// Get a member for the call's semaphore, or job, with this index.
    Join(usize),
    /// A job is a member of another group: release the others.
    LetGo,
    /// Take a signal for this member, or put it in line.
    Enter(usize),
    /// Put this job, which has taken a signal, behind the members that were given one.
    Follow(usize),
    /// Look for a member that was given a signal.
    Receive,
    /// Member `came`, or time if it is `None`, ends the wait: take `next` from its line, and then the others
    /// before `end`.
    Leave { came: Option<usize>, next: usize, end: usize },
    /// Give back the signal of `next`, which was given one too, and continue with the next one.
    GiveBack { came: Option<usize>, next: usize, end: usize },
}

type Next = ControlFlow<Outcome, Stage>;

impl Reference {
    pub(super) fn begin_several(&mut self, id: TaskId, call: Call) {
        let stage = match call {
            Call::WaitForSeveral { .. } | Call::WaitForSeveralTimeout { .. } => Stage::Try(0),
            Call::RunJobs { .. } => Stage::Gather,
            _ => Stage::Enter(self.tasks[id].job.take().expect("it is in a job")),
        };
        self.tasks[id].activity = Activity::Several(call, stage);
    }

    /// Makes the next step of `id` in `call`.
    pub(super) fn go_on_with_several(&mut self, id: TaskId, call: Call, stage: Stage) {
        let next = match stage {
            Stage::Try(index) => self.try_one(call, index),
            Stage::LookAtClock => {
                self.tasks[id].clock = Some(self.now);
                Continue(Stage::Gather)
            }
            Stage::Gather => {
                self.tasks[id].group = Some(Group::default());
                Continue(Stage::Join(0))
            }
            Stage::Join(index) => self.join(id, call, index),
            Stage::LetGo => self.let_go(id),
            Stage::Enter(member) => self.enter(id, call, member),
            Stage::Follow(member) => {
                self.group(id).woken.push_back(member);
                Continue(Self::after(call, member))
            }
            Stage::Receive => match self.group(id).woken.pop_front() {
                Some(member) => self.receive_signal(id, member),
                None if self.end(id, call).is_some_and(|end| end <= self.now) => {
                    return self.end_several(id);
                }
                None => {
                    self.set_end(id, call);
                    return self.block(id, call);
                }
            },
            Stage::Leave { came, next, end } => self.leave_next_line(id, came, next, end),
            Stage::GiveBack { came, next, end } => {
                self.signal(Object::Semaphore(self.member(id, next).semaphore));
                Continue(Stage::Leave { came, next: next + 1, end })
            }
        };
        self.tasks[id].activity = match next {
            Continue(stage) => Activity::Several(call, stage),
            Break(outcome) => Activity::Returning(outcome),
        };
    }

    /// Gives a signal to a member of the group of `id`.
    pub(super) fn arrive(&mut self, id: TaskId, member: usize) {
        self.lines.retain(|&(_, waiter)| waiter != Waiter::Member(id, member));
        self.group(id).woken.push_back(member);
        if let Activity::Blocked(call) = self.tasks[id].activity {
            self.wake(id, Activity::Several(call, Stage::Receive));
        }
    }

    /// Ends the wait of `id`, whose time is up.
    pub(super) fn end_several(&mut self, id: TaskId) {
        self.group(id).is_over = true;
        let stage = Stage::Leave { came: None, next: 0, end: self.group(id).members.len() };
        match self.tasks[id].activity {
            Activity::Blocked(call) => self.wake(id, Activity::Several(call, stage)),
            Activity::Several(call, _) => self.tasks[id].activity = Activity::Several(call, stage),
            _ => unreachable!("it waits for several semaphores"),
        }
    }

    /// Whether the time of the wait of `id` is up.
    pub(super) fn is_over(&self, id: TaskId) -> bool {
        self.tasks[id].group.as_ref().is_some_and(|group| group.is_over)
    }

    pub(super) fn priority_of_member(&self, id: TaskId, member: usize) -> Priority {
        self.member(id, member).priority
    }

    /// Whether the member waits in the queue for a job.
    pub(super) fn is_job(&self, id: TaskId, member: usize) -> bool {
        self.member(id, member).job.is_some()
    }

    fn try_one(&mut self, call: Call, index: usize) -> Next {
        match semaphores(call).get(index) {
            Some(&semaphore) if self.take_signal(Object::Semaphore(semaphore)) => {
                Break((index as u16).into())
            }
            Some(_) => Continue(Stage::Try(index + 1)),
            None => match call {
                Call::WaitForSeveralTimeout { ticks: 0, .. } => Break(Outcome::Elapsed),
                Call::WaitForSeveralTimeout { .. } => Continue(Stage::LookAtClock),
                _ => Continue(Stage::Gather),
            },
        }
    }

    fn join(&mut self, id: TaskId, call: Call, index: usize) -> Next {
        let (semaphore, job) = match call {
            Call::RunJobs { jobs } => match jobs.get(index) {
                Some(&job) if self.is_taken(job) => return Continue(Stage::LetGo),
                Some(&job) => (self.jobs[job], Some(job)),
                None => return Continue(Stage::Enter(0)),
            },
            _ => (semaphores(call)[index], None),
        };
        let priority = self.tasks[id].priority;
        self.group(id).members.push(Member { semaphore, job, priority });
        Continue(if job.is_some() { Stage::Join(index + 1) } else { Stage::Enter(index) })
    }

    fn is_taken(&self, job: usize) -> bool {
        let mut members = self.tasks.iter().flat_map(|task| &task.group).flat_map(|group| &group.members);
        members.any(|member| member.job == Some(job))
    }

    fn let_go(&mut self, id: TaskId) -> Next {
        let members = &mut self.group(id).members;
        if members.is_empty() {
            self.tasks[id].group = None;
            return Break(Outcome::JobTaken);
        }
        members.remove(0);
        Continue(Stage::LetGo)
    }

    fn enter(&mut self, id: TaskId, call: Call, member: usize) -> Next {
        let object = Object::Semaphore(self.member(id, member).semaphore);
        Continue(if !self.take_signal(object) {
            self.stand_in_line(Waiter::Member(id, member), object);
            Self::after(call, member)
        } else if self.is_job(id, member) {
            Stage::Follow(member)
        } else {
            Stage::Leave { came: Some(member), next: 0, end: member }
        })
    }

    /// The step after `member` has entered its line.
    fn after(call: Call, member: usize) -> Stage {
        match call {
            Call::RunJobs { jobs } if member + 1 < jobs.len() => Stage::Enter(member + 1),
            _ if call.several().is_some_and(|all| member + 1 < all.len()) => Stage::Join(member + 1),
            _ => Stage::Receive,
        }
    }

    fn receive_signal(&mut self, id: TaskId, member: usize) -> Next {
        let Some(job) = self.member(id, member).job else {
            return Continue(Stage::Leave { came: Some(member), next: 0, end: self.group(id).members.len() });
        };
        self.tasks[id].job = Some(member);
        Break((job as u16).into())
    }

    fn leave_next_line(&mut self, id: TaskId, came: Option<usize>, next: usize, end: usize) -> Next {
        if next == end {
            self.tasks[id].group = None;
            return Break(came.map_or(Outcome::Elapsed, |came| (came as u16).into()));
        }
        let before = self.lines.len();
        self.lines.retain(|&(_, waiter)| waiter != Waiter::Member(id, next));
        // A member whose wait was over has passed its signal on.
        Continue(if came.is_none_or(|came| came == next) || self.lines.len() < before {
            Stage::Leave { came, next: next + 1, end }
        } else {
            Stage::GiveBack { came, next, end }
        })
    }

    fn group(&mut self, id: TaskId) -> &mut Group {
        self.tasks[id].group.as_mut().expect("it has a group")
    }

    fn member(&self, id: TaskId, member: usize) -> Member {
        self.tasks[id].group.as_ref().expect("it has a group").members[member]
    }
}

fn semaphores(call: Call) -> [usize; SEVERAL] {
    call.several().unwrap_or_else(|| unreachable!("{call:?} waits for none"))
}
