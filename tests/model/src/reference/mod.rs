//! The kernel as `docs/kernel.md` describes it, written as plainly as possible: which task runs, which tasks
//! wait, and the events of time.

mod bytes;
mod calls;
mod control;
mod interrupted;
mod leftover;
mod messages;
mod several;

use std::collections::VecDeque;
use std::mem;

use kernel::{Priority, Ticks};

use crate::call::{Call, Object, Outcome};
use crate::setup::Setup;
use bytes::{Fifo, Motion, Pipe};
use several::{Group, Stage};

pub type TaskId = usize;

/// The state of a task.
#[derive(Clone, Copy, PartialEq)]
enum Activity {
    /// Between two calls.
    Own,
    /// In this call, which blocks.
    Blocked(Call),
    /// In a call that returns this outcome when the task runs.
    Returning(Outcome),
    /// In this call, which acts when the task runs, for the first time or again.
    Acting(Call),
    /// In this wait for flags, which have changed. The call looks again when the task runs.
    Again(Call),
    /// In a call that takes a message when the task runs. A message is promised to it.
    Receiving { queue: usize },
    /// In a call that announces a message when the task runs.
    Announcing { queue: usize },
    /// In a call that counts a message as refused when the task runs.
    Refused { queue: usize },
    /// In this wait for several semaphores, or before a job. The stage comes next when the task runs.
    Several(Call, Stage),
    /// In a call that moves a byte. The motion comes next when the task runs.
    Moving(Motion),
    /// In a call that leaves a ceiling when the task runs.
    Leaving,
    /// In a call that has killed another task, which can be started when this call is over.
    Ending { task: TaskId },
    /// In this call with a timeout. The task is in the wait queue, and is about to block.
    Enlisted(Call),
    /// It was killed by a call that is not over.
    Dying,
    /// It has not been started, or has ended.
    New,
    /// It has left the script: it neither runs nor waits for anything here.
    Gone,
}

#[derive(Clone, PartialEq)]
struct Task {
    priority: Priority,
    /// The priority with which it starts.
    first_priority: Priority,
    activity: Activity,
    is_suspended: bool,
    /// It starts or kills a task, or tries to, and can't be killed meanwhile.
    is_unkillable: bool,
    /// It is in a wait with a timeout, or on its way into or out of one. It can be killed only while it is
    /// blocked.
    is_proxied: bool,
    /// The priority with which it waits in the queue there.
    line_priority: Priority,
    /// It has a mutex, or has found one taken and waits for it.
    locks: bool,
    /// The clock when its present call read it, if it has.
    clock: Option<u64>,
    /// The mutex that it holds, or whose ceiling it has not left yet.
    holds: Option<usize>,
    /// The message that it has made.
    made: Option<u8>,
    /// How many messages it has received and not dropped yet.
    received: usize,
    period: Option<Period>,
    /// The waiters that stand in line in its place.
    group: Option<Group>,
    /// The member of this group whose job runs.
    job: Option<usize>,
}

/// A waiter in a line.
#[derive(Clone, Copy, PartialEq)]
enum Waiter {
    Task(TaskId),
    /// A task whose wait is over, until it runs or a signal passes it over.
    Void(TaskId),
    /// A member of this task's group.
    Member(TaskId, usize),
}

#[derive(Clone, Copy, PartialEq)]
struct Period {
    deadline: Ticks,
    length: Ticks,
    missed: u16,
}

#[derive(Clone, PartialEq)]
struct Mutex {
    ceiling: Priority,
    /// How often it was taken, modulo 256.
    value: u8,
    is_taken: bool,
}

#[derive(Clone, PartialEq)]
struct Queue {
    room: usize,
    messages: VecDeque<u8>,
    /// How many of these messages are promised to tasks that were woken to take one.
    promised: usize,
    refused: u16,
}

/// All queues have one pool.
#[derive(Clone, PartialEq)]
struct Pool {
    used: usize,
    most_used: usize,
    exhausted: u16,
}

/// An event at a time.
#[derive(Clone, PartialEq)]
struct Alarm {
    deadline: u64,
    event: Event,
}

#[derive(Clone, Copy, PartialEq)]
enum Event {
    /// `timer` is `None` while its signal is about to be posted: then it is not running any more.
    Post {
        timer: Option<usize>,
        semaphore: usize,
    },
    EndWait(TaskId),
}

#[derive(Clone, PartialEq)]
pub struct Reference {
    now: u64,
    tasks: Vec<Task>,
    /// The ready tasks, in the order in which they became ready. A preempted task keeps its place.
    ready: Vec<TaskId>,
    /// Waiters with the objects that they wait for. Waiters for the same object are in the order in which
    /// they are served.
    lines: Vec<(Object, Waiter)>,
    /// In the order in which they were set.
    alarms: Vec<Alarm>,
    /// The signals in store.
    semaphores: Vec<u8>,
    mutexes: Vec<Mutex>,
    flags: u8,
    queues: Vec<Queue>,
    pool: Pool,
    fifo: Fifo,
    pipe: Pipe,
    /// The semaphore that each job waits for.
    jobs: Vec<usize>,
}

impl Alarm {
    fn is_of(&self, timer: usize) -> bool {
        matches!(self.event, Event::Post { timer: Some(other), .. } if other == timer)
    }
}

impl Reference {
    /// The kernel at the start.
    pub fn new(setup: &Setup) -> Self {
        let task = |(id, &priority)| Task {
            // A task has its own priority only from its start on.
            priority: if id < setup.started { priority } else { Priority::P0 },
            first_priority: priority,
            is_suspended: false,
            is_unkillable: false,
            is_proxied: false,
            line_priority: priority,
            locks: false,
            activity: if id < setup.started { Activity::Own } else { Activity::New },
            clock: None,
            holds: None,
            made: None,
            received: 0,
            period: None,
            group: None,
            job: None,
        };
        let mutex = |&ceiling| Mutex { ceiling, value: 0, is_taken: false };
        let queue =
            |&room: &u8| Queue { room: room.into(), messages: VecDeque::new(), promised: 0, refused: 0 };
        Reference {
            now: 0,
            tasks: setup.priorities.iter().enumerate().map(task).collect(),
            ready: (0..setup.started).collect(),
            lines: Vec::new(),
            alarms: Vec::new(),
            semaphores: setup.semaphores.clone(),
            mutexes: setup.ceilings.iter().map(mutex).collect(),
            flags: 0,
            queues: setup.rooms.iter().map(queue).collect(),
            pool: Pool { used: 0, most_used: 0, exhausted: 0 },
            fifo: Reference::new_fifo(),
            pipe: Pipe::new(),
            jobs: setup.jobs.clone(),
        }
    }

    /// The task that runs: the highest ready task. Among equals it is a task that a ceiling has raised, then
    /// the first that became ready.
    pub fn running(&self) -> Option<TaskId> {
        self.ready.iter().copied().min_by_key(|&id| {
            let effective = self.effective_priority(id);
            (effective, effective == self.tasks[id].priority)
        })
    }

    fn effective_priority(&self, id: TaskId) -> Priority {
        let task = &self.tasks[id];
        task.holds.map_or(task.priority, |mutex| task.priority.min(self.mutexes[mutex].ceiling))
    }

    /// Whether the running task can make `call` now.
    pub fn permits(&self, call: Call) -> bool {
        let Some(id) = self.running() else { return false };
        let task = &self.tasks[id];
        match call {
            Call::Unlock => task.holds.is_some(),
            // The guard of a mutex borrows the task.
            _ if task.holds.is_some() => false,
            Call::EndJob => task.job.is_some(),
            _ if task.job.is_some() && call.needs_task() => false,
            Call::Make { .. } => task.made.is_none(),
            Call::SendMade { .. } => task.made.is_some(),
            Call::WaitForPeriod => task.period.is_some(),
            _ => true,
        }
    }

    /// The call by which the running task leaves a section of a mutex, or a job, if it is in one.
    pub fn way_out(&self) -> Option<Call> {
        [Call::Unlock, Call::EndJob].into_iter().find(|&call| self.permits(call))
    }

    /// The running task makes a call. The call acts in [`settle`](Self::settle).
    pub fn call(&mut self, call: Call) {
        let id = self.running().expect("a task runs");
        let task = &mut self.tasks[id];
        task.activity = Activity::Acting(call);
        if let (Call::WaitForPeriod, Some(period)) = (call, &mut task.period) {
            period.deadline = period.deadline.wrapping_add(period.length);
        }
        // A job does not inherit messages of another job.
        if matches!(call, Call::RunJobs { .. } | Call::EndJob) {
            self.drop_messages(id);
        }
    }

    /// The running task's call returns. Returns its outcome, if the task is in a call.
    pub fn returned(&mut self) -> Option<Outcome> {
        let id = self.running()?;
        let Activity::Returning(outcome) = self.tasks[id].activity else { return None };
        self.tasks[id].activity = Activity::Own;
        self.tasks[id].clock = None;
        Some(outcome)
    }

    /// The running task leaves.
    pub fn leave(&mut self) {
        let id = self.running().expect("a task runs");
        self.ready.retain(|&other| other != id);
        self.tasks[id].activity = Activity::Gone;
        self.drop_messages(id);
    }

    /// Whether all tasks have left, except those that run jobs for ever.
    pub fn is_deserted(&self) -> bool {
        self.tasks.iter().all(|task| {
            matches!(task.activity, Activity::Gone | Activity::Blocked(Call::RunJobs { .. } | Call::EndJob))
        })
    }

    /// Brings back all tasks that have left.
    pub fn come_back(&mut self) {
        self.ready = (0..self.tasks.len()).filter(|&id| self.tasks[id].activity == Activity::Gone).collect();
        self.ready.iter().for_each(|&id| self.tasks[id].activity = Activity::Own);
    }

    /// An interrupt comes and goes. Returns the outcomes of its calls.
    pub fn interrupt(&mut self, calls: &[Call]) -> Vec<Outcome> {
        calls.iter().map(|&call| self.call_of_interrupt(call)).collect()
    }

    /// A tick passes.
    pub fn pass(&mut self) {
        self.now += 1;
    }

    /// Makes all events happen that are due by now.
    pub fn fire(&mut self) {
        while self.fire_first() {}
    }

    /// The index of the first event that is due by now.
    fn first_due(&self) -> Option<usize> {
        let due = self.alarms.iter().enumerate().filter(|(_, alarm)| alarm.deadline <= self.now);
        due.min_by_key(|(_, alarm)| alarm.deadline).map(|(index, _)| index)
    }

    /// Makes the first event happen that is due by now. Returns whether there was one.
    fn fire_first(&mut self) -> bool {
        let Some(first) = self.first_due() else { return false };
        let Alarm { event, .. } = self.alarms.remove(first);
        match event {
            Event::Post { semaphore, .. } => self.signal(Object::Semaphore(semaphore)),
            Event::EndWait(id) => {
                // A task that does not wait yet looks at the clock itself before it waits.
                if let Activity::Blocked(Call::WaitForSeveralTimeout { .. }) = self.tasks[id].activity {
                    self.end_several(id);
                } else if let Activity::Blocked(call) = self.tasks[id].activity {
                    self.void_line(id);
                    self.wake(id, Activity::Returning(self.outcome_in_the_end(id, call)));
                }
            }
        }
        true
    }

    /// The running task makes the steps of its call. If it blocks, the next task does so, until one is about
    /// to return from its call, or is between two calls.
    pub fn settle(&mut self) {
        while self.settle_first() {}
    }

    /// The running task makes the next step of its call. Returns whether there was one.
    fn settle_first(&mut self) -> bool {
        let Some(id) = self.running() else { return false };
        let task = &mut self.tasks[id];
        let is_in_wait = matches!(task.activity, Activity::Enlisted(_) | Activity::Acting(_));
        if task.is_proxied && !is_in_wait {
            task.is_proxied = false;
            self.lines.retain(|&(_, waiter)| waiter != Waiter::Void(id));
            return true;
        }
        if task.is_unkillable && !matches!(task.activity, Activity::Acting(_)) {
            task.is_unkillable = false;
            return true;
        }
        if task.locks && task.holds.is_none() && task.activity == Activity::Returning(Outcome::Elapsed) {
            task.locks = false;
            return true;
        }
        match task.activity {
            Activity::Acting(call) => self.perform(id, call),
            Activity::Again(call) => task.activity = Activity::Acting(call),
            Activity::Receiving { queue } => self.take_promised(id, queue),
            Activity::Announcing { queue } => {
                self.tasks[id].activity = Activity::Returning(Outcome::Nothing);
                self.announce(queue);
            }
            Activity::Refused { queue } => {
                self.count_refused(queue);
                self.tasks[id].activity = Activity::Returning(Outcome::Full);
            }
            Activity::Enlisted(call) => self.block_enlisted(id, call),
            Activity::Ending { task } => {
                self.lines.retain(|&(_, waiter)| waiter != Waiter::Void(task));
                self.tasks[task].activity = Activity::New;
                self.tasks[id].activity = Activity::Returning(Outcome::Nothing);
            }
            Activity::Several(call, stage) => self.go_on_with_several(id, call, stage),
            Activity::Moving(motion) => self.go_on_with_motion(id, motion),
            Activity::Leaving => {
                self.tasks[id].activity = Activity::Returning(Outcome::Nothing);
                self.leave_ceiling(id);
            }
            _ => return false,
        }
        true
    }

    /// Makes a blocked task ready. A task that is about to block is still ready.
    fn wake(&mut self, id: TaskId, activity: Activity) {
        self.leave_line(id);
        self.cancel_end(id);
        let is_blocked = !matches!(self.tasks[id].activity, Activity::Enlisted(_));
        self.tasks[id].activity = activity;
        if is_blocked {
            self.make_ready(id);
        }
    }

    /// Appends a task to the ready ones, unless it is suspended.
    fn make_ready(&mut self, id: TaskId) {
        self.ready.retain(|&other| other != id);
        if !self.tasks[id].is_suspended {
            self.ready.push(id);
        }
    }

    /// Blocks the running task in `call`.
    fn block(&mut self, id: TaskId, call: Call) {
        self.ready.retain(|&other| other != id);
        if let Some(object) = call.awaits() {
            self.stand_in_line(Waiter::Task(id), object);
        }
        self.tasks[id].activity = Activity::Blocked(call);
    }

    /// Puts a waiter in line before the first one of lower priority.
    fn stand_in_line(&mut self, waiter: Waiter, object: Object) {
        let priority = self.priority_in_line(waiter);
        let is_behind =
            |&(other, behind): &(Object, Waiter)| other == object && self.priority_in_line(behind) > priority;
        let place = self.lines.iter().position(is_behind).unwrap_or(self.lines.len());
        self.lines.insert(place, (object, waiter));
    }

    fn priority_in_line(&self, waiter: Waiter) -> Priority {
        match waiter {
            Waiter::Task(id) if !self.tasks[id].is_proxied => self.tasks[id].priority,
            Waiter::Task(id) | Waiter::Void(id) => self.tasks[id].line_priority,
            Waiter::Member(id, member) => self.priority_of_member(id, member),
        }
    }

    /// The first waiter for `object`.
    fn first_in_line(&self, object: Object) -> Option<Waiter> {
        let is_first = |&&(other, waiter): &&(Object, Waiter)| other == object && !self.is_void(waiter);
        self.lines.iter().find(is_first).map(|&(_, waiter)| waiter)
    }

    /// A signal for `object` removes the waiters whose wait is over, up to the first one that still waits.
    fn pass_over(&mut self, object: Object) {
        let mut has_passed = false;
        let mut lines = mem::take(&mut self.lines);
        lines.retain(|&(other, waiter)| {
            let is_void = self.is_void(waiter);
            has_passed |= other == object && !is_void;
            other != object || !is_void || has_passed
        });
        self.lines = lines;
    }

    /// Whether the waiter's wait is over.
    fn is_void(&self, waiter: Waiter) -> bool {
        match waiter {
            Waiter::Task(_) => false,
            Waiter::Void(_) => true,
            Waiter::Member(id, _) => self.is_over(id),
        }
    }

    /// The first task that waits for `object`, for which only tasks wait, and no group.
    fn first_task_in_line(&self, object: Object) -> Option<TaskId> {
        match self.first_in_line(object)? {
            Waiter::Task(id) => Some(id),
            Waiter::Member(..) | Waiter::Void(_) => unreachable!("groups wait for semaphores"),
        }
    }

    /// The present tick, as the kernel tells it: modulo 65,536.
    pub fn ticks(&self) -> Ticks {
        self.now as Ticks
    }
}
