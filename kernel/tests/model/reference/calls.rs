//! What each call does.

use kernel::{LONGEST, Ticks};

use super::{Activity, Alarm, Event, Period, Reference, TaskId};
use crate::call::{Call, FIFO_BYTES, Object, Outcome};

impl Reference {
    /// `id`, which runs, calls.
    pub(super) fn perform(&mut self, id: TaskId, call: Call) {
        let clock = *self.tasks[id].clock.get_or_insert(self.now);
        let outcome = match call {
            Call::Wait { semaphore } | Call::WaitTimeout { semaphore, .. } => {
                self.take_signal(semaphore).then_some(Outcome::Nothing)
            }
            Call::WaitAny(flags) => match self.take_flags(flags) {
                0 => None,
                taken => Some(Outcome::Number(taken.into())),
            },
            Call::WaitAll(flags) => {
                let are_set = self.flags & flags == flags;
                are_set.then(|| {
                    self.take_flags(flags);
                    Outcome::Nothing
                })
            }
            Call::Lock { mutex } if self.mutexes[mutex].is_taken => {
                self.tasks[id].locks = true;
                None
            }
            Call::Lock { mutex } => Some(self.lock(id, mutex)),
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
            Call::StartTimer { timer, ticks, semaphore } => {
                self.disarm(timer);
                self.alarms.push(Alarm {
                    deadline: deadline(clock, ticks),
                    event: Event::Post { timer, semaphore },
                });
                self.fire();
                Some(Outcome::Nothing)
            }
            Call::CancelTimer { timer } => Some(Outcome::Truth(self.disarm(timer))),
            Call::Yield => {
                self.make_ready(id);
                Some(Outcome::Nothing)
            }
            Call::Suspend { task } => Some(self.suspend(id, task)),
            Call::SetPriority { task, priority } => Some(self.set_priority(id, task, priority)),
            Call::State { task } => Some(Outcome::State(self.state(task))),
            Call::Kill { task } if task != id => Some(self.kill(id, task)),
            Call::Kill { .. } | Call::Exit => return self.end_task(id),
            Call::Delay(_) => None,
            Call::DelayUntil(deadline) => {
                let is_over = !is_ahead(deadline.wrapping_sub(clock as Ticks));
                is_over.then_some(Outcome::Truth(false))
            }
            Call::StartPeriod(length) => {
                self.tasks[id].period = Some(Period { deadline: self.ticks(), length, missed: 0 });
                Some(Outcome::Nothing)
            }
            Call::WaitForPeriod => self.missed_deadline(id, clock),
            _ => Some(self.call_of_either(call)),
        };
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

    /// Sets the time at which `call` ends by itself, if it does and that is not set yet.
    pub(super) fn set_end(&mut self, id: TaskId, call: Call) {
        let event = Event::EndWait(id);
        if !self.alarms.iter().any(|alarm| alarm.event == event) {
            self.alarms.extend(self.end(id, call).map(|deadline| Alarm { deadline, event }));
        }
    }

    pub(super) fn cancel_end(&mut self, id: TaskId) {
        self.alarms.retain(|alarm| alarm.event != Event::EndWait(id));
    }

    /// An interrupt calls. It drops at once what it receives.
    pub(super) fn call_of_interrupt(&mut self, call: Call) -> Outcome {
        if let Call::TryReceive { queue } = call {
            let message = self.receive(queue);
            self.pool.used -= usize::from(message.is_some());
            return Outcome::Byte(message);
        }
        self.call_of_either(call)
    }

    /// What a task and an interrupt do alike.
    fn call_of_either(&mut self, call: Call) -> Outcome {
        match call {
            Call::Start { task } => Outcome::Truth(self.start(task)),
            Call::Resume { task } => Outcome::Truth(self.resume(task)),
            Call::Post { semaphore } => self.post(semaphore),
            Call::TryWait { semaphore } => Outcome::Truth(self.take_signal(semaphore)),
            Call::SetFlags(flags) => self.set_flags(flags),
            Call::TakeFlags(flags) => Outcome::Number(self.take_flags(flags).into()),
            Call::Send { queue, value } => self.make_and_send(queue, value),
            Call::Refused { queue } => Outcome::Number(self.queues[queue].refused),
            Call::PoolMostUsed => Outcome::Number(self.pool.most_used as u16),
            Call::PoolExhausted => Outcome::Number(self.pool.exhausted),
            Call::Put(byte) => self.put(byte),
            Call::Take => Outcome::Byte(self.bytes.pop_front()),
            Call::Overruns => Outcome::Number(self.overruns),
            Call::Now => Outcome::Number(self.ticks()),
            _ => unreachable!("a task only can make {call:?}"),
        }
    }

    pub(super) fn post(&mut self, semaphore: usize) -> Outcome {
        match self.first_in_line(Object::Semaphore(semaphore)) {
            Some(id) => self.wake(id, Activity::Returning(Outcome::Nothing)),
            None => self.semaphores[semaphore] = self.semaphores[semaphore].saturating_add(1),
        }
        Outcome::Nothing
    }

    fn take_signal(&mut self, semaphore: usize) -> bool {
        let is_taken = self.semaphores[semaphore] > 0;
        self.semaphores[semaphore] -= u8::from(is_taken);
        is_taken
    }

    /// Wakes all who wait for flags, to look again.
    fn set_flags(&mut self, flags: u8) -> Outcome {
        self.flags |= flags;
        while self.wake_for_flags() {}
        Outcome::Nothing
    }

    /// Wakes the first who waits for flags. Returns whether there was one.
    pub(super) fn wake_for_flags(&mut self) -> bool {
        let Some(id) = self.first_in_line(Object::Flags) else { return false };
        let Activity::Blocked(call) = self.tasks[id].activity else { unreachable!("it is blocked") };
        self.wake(id, Activity::Acting(call));
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

    /// Hands the mutex to the first who waits for it, and then leaves its ceiling.
    fn unlock(&mut self, id: TaskId) -> Outcome {
        self.hand_over(id);
        self.leave_ceiling(id)
    }

    pub(super) fn hand_over(&mut self, id: TaskId) {
        let mutex = self.tasks[id].holds.expect("it holds one");
        self.mutexes[mutex].is_taken = false;
        if let Some(next) = self.first_in_line(Object::Mutex(mutex)) {
            let outcome = self.lock(next, mutex);
            self.wake(next, Activity::Returning(outcome));
        }
    }

    pub(super) fn leave_ceiling(&mut self, id: TaskId) -> Outcome {
        self.tasks[id].holds = None;
        self.tasks[id].locks = false;
        Outcome::Nothing
    }

    fn put(&mut self, byte: u8) -> Outcome {
        if self.bytes.len() == FIFO_BYTES {
            self.overruns = self.overruns.saturating_add(1);
            return Outcome::Byte(None);
        }
        self.bytes.push_back(byte);
        Outcome::Byte(Some((FIFO_BYTES - self.bytes.len()) as u8))
    }

    /// Returns whether the timer was armed.
    pub(super) fn disarm(&mut self, timer: usize) -> bool {
        let armed = self.alarms.len();
        self.alarms
            .retain(|alarm| !matches!(alarm.event, Event::Post { timer: other, .. } if other == timer));
        self.alarms.len() < armed
    }

    /// Returns the number of deadlines missed if that of the task's period has passed.
    fn missed_deadline(&mut self, id: TaskId, clock: u64) -> Option<Outcome> {
        let period = self.tasks[id].period.as_mut().expect("it has started one");
        if is_ahead(period.deadline.wrapping_sub(clock as Ticks)) {
            return None;
        }
        period.missed = period.missed.saturating_add(1);
        Some(Outcome::Number(period.missed))
    }

    /// The tick at which a call that can't go on ends by itself.
    fn end(&self, id: TaskId, call: Call) -> Option<u64> {
        let clock = self.tasks[id].clock?;
        let ticks = match call {
            Call::WaitTimeout { ticks, .. } | Call::ReceiveTimeout { ticks, .. } | Call::Delay(ticks) => {
                ticks
            }
            Call::DelayUntil(deadline) => deadline.wrapping_sub(clock as Ticks),
            Call::WaitForPeriod => self.tasks[id].period?.deadline.wrapping_sub(clock as Ticks),
            _ => return None,
        };
        Some(deadline(clock, ticks))
    }

    /// What a call returns that has ended by itself.
    pub(super) fn outcome_in_the_end(&self, id: TaskId, call: Call) -> Outcome {
        match call {
            Call::WaitTimeout { .. } | Call::ReceiveTimeout { .. } => Outcome::Elapsed,
            Call::DelayUntil(_) => Outcome::Truth(true),
            Call::WaitForPeriod => Outcome::Number(self.tasks[id].period.map_or(0, |period| period.missed)),
            _ => Outcome::Nothing,
        }
    }
}

/// The tick so many ticks after `start`: at least 1 and at most `LONGEST`.
pub(super) fn deadline(start: u64, ticks: Ticks) -> u64 {
    start + u64::from(ticks.clamp(1, LONGEST))
}

/// Whether a deadline so many ticks from now lies in the future.
fn is_ahead(ticks: Ticks) -> bool {
    (1..=LONGEST).contains(&ticks)
}
