//! The effects of each call.

use kernel::{LONGEST, Refused, Ticks};

use super::bytes::Motion;
use super::{Activity, Alarm, Event, Period, Reference, TaskId, Waiter};
use crate::call::{Call, Object, Outcome};

impl Reference {
    /// The running task `id` makes a call.
    pub(super) fn perform(&mut self, id: TaskId, call: Call) {
        if let Some(motion) = Motion::begun_by(call) {
            self.tasks[id].activity = Activity::Moving(motion);
            return;
        }
        let clock = *self.tasks[id].clock.get_or_insert(self.now);
        let outcome = match call {
            Call::WaitForSeveral { .. }
            | Call::WaitForSeveralTimeout { .. }
            | Call::RunJobs { .. }
            | Call::EndJob => return self.begin_several(id, call),
            Call::Wait { .. }
            | Call::WaitTimeout { .. }
            | Call::PipePut(_)
            | Call::PipePutTimeout { .. }
            | Call::PipeTake
            | Call::PipeTakeTimeout { .. } => {
                if call.awaits().is_some_and(|object| self.take_signal(object)) {
                    self.cancel_end(id);
                    self.tasks[id].activity = with_signal(call);
                    return;
                }
                None
            }
            Call::WaitAny(flags) | Call::WaitAnyTimeout { flags, .. } => match self.take_flags(flags) {
                0 => None,
                taken => Some(Outcome::Number(taken.into())),
            },
            Call::WaitAll(flags) | Call::WaitAllTimeout { flags, .. } => {
                let are_set = self.flags & flags == flags;
                are_set.then(|| {
                    self.take_flags(flags);
                    Outcome::Nothing
                })
            }
            Call::TryLock { mutex } if self.mutexes[mutex].is_taken => Some(Outcome::Truth(false)),
            Call::Lock { mutex } | Call::LockTimeout { mutex, .. } if self.mutexes[mutex].is_taken => {
                self.tasks[id].locks = true;
                None
            }
            Call::Lock { mutex } | Call::TryLock { mutex } | Call::LockTimeout { mutex, .. } => {
                Some(self.lock(id, mutex))
            }
            Call::Unlock => Some(self.unlock(id)),
            Call::TryReceive { queue } => {
                let message = self.receive(queue);
                self.tasks[id].received += usize::from(message.is_some());
                Some(Outcome::Byte(message))
            }
            Call::Receive { queue } | Call::ReceiveTimeout { queue, .. } => {
                let message = self.receive(queue);
                self.tasks[id].received += usize::from(message.is_some());
                message.map(|value| Outcome::Byte(Some(value)))
            }
            Call::Make { value } => {
                let is_made = self.take_buffer();
                self.tasks[id].made = is_made.then_some(value);
                Some(if is_made { Outcome::Nothing } else { Outcome::Exhausted })
            }
            Call::SendMade { queue } if self.is_full(queue) => {
                self.count_refused(queue);
                Some(Outcome::Full)
            }
            Call::SendMade { queue } => {
                let value = self.tasks[id].made.take().expect("it has made one");
                self.append(queue, value);
                self.announce(queue);
                Some(Outcome::Nothing)
            }
            Call::DropMessages => Some(self.drop_messages(id)),
            Call::Yield => {
                self.make_ready(id);
                Some(Outcome::Nothing)
            }
            Call::Kill { task } if task == id && self.tasks[id].group.is_some() => {
                Some(Outcome::Refused(Refused::Busy))
            }
            Call::Kill { task } if task == id => return self.end_task(id, Activity::New),
            Call::Kill { task } => match self.begin_to_kill(id, task) {
                Ok(()) => return,
                Err(refused) => Some(Outcome::Refused(refused)),
            },
            Call::Exit => return self.end_task(id, Activity::New),
            Call::Delay(0) => Some(Outcome::Nothing),
            Call::Delay(_) => None,
            Call::DelayUntil(deadline) => {
                let is_over = !is_ahead(deadline.wrapping_sub(clock as Ticks));
                is_over.then_some(Outcome::Truth(false))
            }
            Call::StartPeriod(length) => {
                let length = length.clamp(1, LONGEST);
                self.tasks[id].period = Some(Period { deadline: self.ticks(), length, missed: 0 });
                Some(Outcome::Nothing)
            }
            Call::WaitForPeriod => self.missed_deadline(id, clock),
            _ => Some(self.call_of_thread(Some(id), clock, call)),
        };
        if outcome.is_none() && call.timeout().is_some_and(|ticks| ticks > 0) {
            return self.enlist(id, call);
        }
        let is_at_end = self.end(id, call).is_some_and(|end| end <= self.now);
        let in_the_end = is_at_end.then(|| self.outcome_in_the_end(id, call));
        match outcome.or(in_the_end) {
            Some(outcome) => {
                self.cancel_end(id);
                self.tasks[id].activity = Activity::Returning(outcome);
            }
            None => {
                self.set_end(id, call);
                self.block(id, call);
            }
        }
    }

    /// Puts the running task in line, in a call with a timeout. It keeps running.
    fn enlist(&mut self, id: TaskId, call: Call) {
        let object = call.awaits().expect("a call with a timeout waits for something");
        self.tasks[id].is_proxied = true;
        self.tasks[id].line_priority = self.tasks[id].priority;
        self.stand_in_line(Waiter::Task(id), object);
        self.tasks[id].activity = Activity::Enlisted(call);
    }

    /// Blocks the running task, which is in the wait queue, unless its time is up.
    pub(super) fn block_enlisted(&mut self, id: TaskId, call: Call) {
        if self.end(id, call).is_some_and(|end| end <= self.now) {
            self.void_line(id);
            self.cancel_end(id);
            self.tasks[id].activity = Activity::Returning(self.outcome_in_the_end(id, call));
        } else {
            self.set_end(id, call);
            self.ready.retain(|&other| other != id);
            self.tasks[id].activity = Activity::Blocked(call);
        }
    }

    /// Sets the time at which `call` ends by itself, if there is one and it is not set yet.
    pub(super) fn set_end(&mut self, id: TaskId, call: Call) {
        let event = Event::EndWait(id);
        if !self.alarms.iter().any(|alarm| alarm.event == event) {
            self.alarms.extend(self.end(id, call).map(|deadline| Alarm { deadline, event }));
        }
    }

    pub(super) fn cancel_end(&mut self, id: TaskId) {
        self.alarms.retain(|alarm| alarm.event != Event::EndWait(id));
    }

    /// A call of an interrupt. It drops a received message at once.
    pub(super) fn call_of_interrupt(&mut self, call: Call) -> Outcome {
        self.call_at_once(call).unwrap_or_else(|| self.call_of_any(call))
    }

    /// A call before the kernel runs. It drops a received message at once.
    pub fn call_of_boot(&mut self, call: Call) -> Outcome {
        self.call_at_once(call).unwrap_or_else(|| self.call_of_thread(None, self.now, call))
    }

    /// A call that is a single step unless a task makes it.
    fn call_at_once(&mut self, call: Call) -> Option<Outcome> {
        if let Call::TryReceive { queue } = call {
            let message = self.receive(queue);
            self.pool.used -= usize::from(message.is_some());
            return Some(message.into());
        }
        Motion::begun_by(call).map(|motion| self.move_at_once(motion))
    }

    /// A call that a task, a job and the code that starts the tasks may make. `id` is the task, if there is
    /// one.
    fn call_of_thread(&mut self, id: Option<TaskId>, clock: u64, call: Call) -> Outcome {
        match call {
            Call::StartTimer { timer, ticks, semaphore } => {
                self.disarm(timer);
                self.alarms.push(Alarm {
                    deadline: deadline(clock, ticks.min(LONGEST)),
                    event: Event::Post { timer: Some(timer), semaphore },
                });
                self.fire();
                Outcome::Nothing
            }
            Call::CancelTimer { timer } => self.disarm(timer).into(),
            Call::Suspend { task } => self.suspend(id, task).into(),
            Call::SetPriority { task, priority } => self.set_priority(id, task, priority).into(),
            Call::State { task } => Outcome::State(self.state(task)),
            Call::Kill { task } => self.kill(id, task).into(),
            _ => self.call_of_any(call),
        }
    }

    /// A call that any context may make.
    fn call_of_any(&mut self, call: Call) -> Outcome {
        match call {
            Call::Start { task } => self.start(task).into(),
            Call::Resume { task } => self.resume(task).into(),
            Call::Priority { task } => Outcome::Priority(self.tasks[task].priority),
            Call::Post { semaphore } => self.signal(Object::Semaphore(semaphore)).into(),
            Call::TryWait { semaphore } => self.take_signal(Object::Semaphore(semaphore)).into(),
            Call::SetFlags(flags) => self.set_flags(flags).into(),
            Call::TakeFlags(flags) => self.take_flags(flags).into(),
            Call::Send { queue, value } => self.make_and_send(queue, value),
            Call::Refused { queue } => self.queues[queue].refused.into(),
            Call::PoolMostUsed => (self.pool.most_used as u16).into(),
            Call::PoolExhausted => self.pool.exhausted.into(),
            Call::TimerIsRunning { timer } => self.is_running(timer).into(),
            Call::Now => self.ticks().into(),
            _ => self.call_for_bytes(call),
        }
    }

    /// Gives a signal for `object` to the first waiter, or stores it.
    pub(super) fn signal(&mut self, object: Object) {
        self.pass_over(object);
        match self.first_in_line(object) {
            Some(Waiter::Void(_)) => unreachable!("it is passed over"),
            Some(Waiter::Member(id, member)) => self.arrive(id, member),
            Some(Waiter::Task(id)) => {
                let (Activity::Blocked(call) | Activity::Enlisted(call)) = self.tasks[id].activity else {
                    unreachable!("it waits in line")
                };
                self.wake(id, with_signal(call));
            }
            None => {
                let signals = self.signals(object);
                *signals = signals.saturating_add(1);
            }
        }
    }

    /// Takes a signal for `object`, if there is one. Returns whether there was.
    pub(super) fn take_signal(&mut self, object: Object) -> bool {
        let signals = self.signals(object);
        let is_taken = *signals > 0;
        *signals -= u8::from(is_taken);
        is_taken
    }

    /// The object's signals in store.
    fn signals(&mut self, object: Object) -> &mut u8 {
        match object {
            Object::Semaphore(semaphore) => &mut self.semaphores[semaphore],
            Object::Byte => &mut self.pipe.bytes,
            Object::Space => &mut self.pipe.space,
            Object::Mutex(_) | Object::Queue(_) | Object::Flags => unreachable!("it has no signals"),
        }
    }

    /// Wakes all tasks that wait for flags, to look again.
    fn set_flags(&mut self, flags: u8) {
        self.flags |= flags;
        while self.wake_for_flags() {}
    }

    /// Wakes the first task that waits for flags. Returns whether there was one.
    pub(super) fn wake_for_flags(&mut self) -> bool {
        self.pass_over(Object::Flags);
        let Some(id) = self.first_task_in_line(Object::Flags) else { return false };
        let (Activity::Blocked(call) | Activity::Enlisted(call)) = self.tasks[id].activity else {
            unreachable!("it waits in line")
        };
        self.wake(id, Activity::Again(call));
        true
    }

    fn take_flags(&mut self, flags: u8) -> u8 {
        let taken = self.flags & flags;
        self.flags &= !taken;
        taken
    }

    fn lock(&mut self, id: TaskId, mutex: usize) -> Outcome {
        self.tasks[id].holds = Some(mutex);
        self.tasks[id].locks = true;
        let mutex = &mut self.mutexes[mutex];
        mutex.is_taken = true;
        let value = mutex.value;
        mutex.value = value.wrapping_add(1);
        Outcome::Number(value.into())
    }

    /// Hands the mutex to the first task that waits for it, and then leaves its ceiling.
    fn unlock(&mut self, id: TaskId) -> Outcome {
        self.hand_over(id);
        self.leave_ceiling(id)
    }

    pub(super) fn hand_over(&mut self, id: TaskId) {
        let mutex = self.tasks[id].holds.expect("it holds one");
        self.mutexes[mutex].is_taken = false;
        self.pass_over(Object::Mutex(mutex));
        if let Some(next) = self.first_task_in_line(Object::Mutex(mutex)) {
            let outcome = self.lock(next, mutex);
            self.wake(next, Activity::Returning(outcome));
        }
    }

    pub(super) fn leave_ceiling(&mut self, id: TaskId) -> Outcome {
        self.tasks[id].holds = None;
        self.tasks[id].locks = false;
        Outcome::Nothing
    }

    /// Disarms a timer. Returns whether it was armed.
    pub(super) fn disarm(&mut self, timer: usize) -> bool {
        let was_running = self.is_running(timer);
        self.alarms.retain(|alarm| !alarm.is_of(timer));
        was_running
    }

    fn is_running(&self, timer: usize) -> bool {
        self.alarms.iter().any(|alarm| alarm.is_of(timer))
    }

    /// Returns the number of missed deadlines if the deadline of the task's period has passed.
    fn missed_deadline(&mut self, id: TaskId, clock: u64) -> Option<Outcome> {
        let period = self.tasks[id].period.as_mut().expect("it has started one");
        if (1..=period.length).contains(&period.deadline.wrapping_sub(clock as Ticks)) {
            return None;
        }
        period.missed = period.missed.saturating_add(1);
        Some(Outcome::Number(period.missed))
    }

    /// The tick at which a call that can't continue ends by itself.
    pub(super) fn end(&self, id: TaskId, call: Call) -> Option<u64> {
        let clock = self.tasks[id].clock?;
        let ticks = match call {
            Call::WaitForSeveralTimeout { ticks, .. } => ticks.min(LONGEST),
            Call::Delay(ticks) => ticks,
            Call::DelayUntil(deadline) => deadline.wrapping_sub(clock as Ticks),
            Call::WaitForPeriod => self.tasks[id].period?.deadline.wrapping_sub(clock as Ticks),
            _ => call.timeout()?.min(LONGEST),
        };
        Some(deadline(clock, ticks))
    }

    /// The outcome of a call that has ended by itself.
    pub(super) fn outcome_in_the_end(&self, id: TaskId, call: Call) -> Outcome {
        match call {
            _ if call.timeout().is_some() => Outcome::Elapsed,
            Call::DelayUntil(_) => Outcome::Truth(true),
            Call::WaitForPeriod => Outcome::Number(self.tasks[id].period.map_or(0, |period| period.missed)),
            _ => Outcome::Nothing,
        }
    }
}

/// The state of a task that waited in `call` and is given the signal.
fn with_signal(call: Call) -> Activity {
    match call {
        Call::PipePut(byte) | Call::PipePutTimeout { byte, .. } => {
            Activity::Moving(Motion::Fill(byte, Outcome::Nothing))
        }
        Call::PipeTake | Call::PipeTakeTimeout { .. } => Activity::Moving(Motion::Drain { flushes: false }),
        _ => Activity::Returning(Outcome::Nothing),
    }
}

/// The tick so many ticks after `start`.
pub(super) fn deadline(start: u64, ticks: Ticks) -> u64 {
    start + u64::from(ticks)
}

/// Whether a deadline so many ticks from now lies in the future.
fn is_ahead(ticks: Ticks) -> bool {
    (1..=LONGEST).contains(&ticks)
}
