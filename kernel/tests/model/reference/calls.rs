//! What each call does.

use kernel::{LONGEST, Ticks};

use super::{Activity, Event, Period, Reference, TaskId};
use crate::call::{BUFFERS, Call, FIFO_BYTES, Outcome};

impl Reference {
    /// `id`, which runs, calls.
    pub(super) fn perform(&mut self, id: TaskId, call: Call) {
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
            Call::Lock { mutex } if self.mutexes[mutex].is_taken => None,
            Call::Lock { mutex } => Some(self.lock(id, mutex)),
            Call::Unlock => Some(self.unlock(id)),
            Call::TryReceive { queue } => {
                let message = self.receive(queue);
                self.tasks[id].messages += usize::from(message.is_some());
                Some(Outcome::Byte(message))
            }
            Call::Receive { queue } | Call::ReceiveTimeout { queue, .. } => {
                let message = self.receive(queue);
                self.tasks[id].messages += usize::from(message.is_some());
                message.map(|value| Outcome::Byte(Some(value)))
            }
            Call::DropMessages => Some(self.drop_messages(id)),
            Call::Yield => {
                self.ready.retain(|&other| other != id);
                self.ready.push(id);
                Some(Outcome::Nothing)
            }
            Call::Delay(_) => None,
            Call::DelayUntil(ticks) => (!is_ahead(ticks)).then_some(Outcome::Truth(false)),
            Call::StartPeriod(length) => {
                self.tasks[id].period = Some(Period { deadline: self.ticks(), length, missed: 0 });
                Some(Outcome::Nothing)
            }
            Call::WaitForPeriod => self.next_deadline(id),
            _ => Some(self.call_of_either(call)),
        };
        match outcome {
            Some(outcome) => self.tasks[id].activity = Activity::Returning(outcome),
            None => {
                self.block(id, call);
                if let Some(ticks) = self.longest_wait(id, call) {
                    self.set_alarm(Event::EndWait(id), ticks);
                }
            }
        }
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
            Call::Post { semaphore } => self.post(semaphore),
            Call::TryWait { semaphore } => Outcome::Truth(self.take_signal(semaphore)),
            Call::SetFlags(flags) => self.set_flags(flags),
            Call::TakeFlags(flags) => Outcome::Number(self.take_flags(flags).into()),
            Call::Send { queue, value } => self.send(queue, value),
            Call::Refused { queue } => Outcome::Number(self.queues[queue].refused),
            Call::PoolMostUsed => Outcome::Number(self.pool.most_used as u16),
            Call::PoolExhausted => Outcome::Number(self.pool.exhausted),
            Call::Put(byte) => self.put(byte),
            Call::Take => Outcome::Byte(self.bytes.pop_front()),
            Call::Overruns => Outcome::Number(self.overruns),
            Call::Now => Outcome::Number(self.ticks()),
            Call::StartTimer { timer, ticks, semaphore } => {
                self.disarm(timer);
                self.set_alarm(Event::Post { timer, semaphore }, ticks);
                Outcome::Nothing
            }
            Call::CancelTimer { timer } => Outcome::Truth(self.disarm(timer)),
            _ => unreachable!("a task only can make {call:?}"),
        }
    }

    pub(super) fn post(&mut self, semaphore: usize) -> Outcome {
        let waits = |call| matches!(call, Call::Wait { semaphore: other } | Call::WaitTimeout { semaphore: other, .. } if other == semaphore);
        match self.first_blocked(waits) {
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
        while let Some(id) = self.first_blocked(|call| matches!(call, Call::WaitAny(_) | Call::WaitAll(_))) {
            let Activity::Blocked(call) = self.tasks[id].activity else { unreachable!("it is blocked") };
            self.wake(id, Activity::Retrying(call));
        }
        Outcome::Nothing
    }

    fn take_flags(&mut self, flags: u8) -> u8 {
        let taken = self.flags & flags;
        self.flags &= !taken;
        taken
    }

    fn lock(&mut self, id: TaskId, mutex: usize) -> Outcome {
        self.tasks[id].holds = Some(mutex);
        let mutex = &mut self.mutexes[mutex];
        mutex.is_taken = true;
        let value = mutex.value;
        mutex.value = value.wrapping_add(1);
        Outcome::Number(value.into())
    }

    /// Hands the mutex to the first who waits for it.
    fn unlock(&mut self, id: TaskId) -> Outcome {
        let mutex = self.tasks[id].holds.take().expect("it holds one");
        self.mutexes[mutex].is_taken = false;
        if let Some(next) = self.first_blocked(|call| call == Call::Lock { mutex }) {
            let outcome = self.lock(next, mutex);
            self.wake(next, Activity::Returning(outcome));
        }
        Outcome::Nothing
    }

    fn send(&mut self, index: usize, value: u8) -> Outcome {
        if self.pool.used == BUFFERS {
            self.pool.exhausted = self.pool.exhausted.saturating_add(1);
            return Outcome::Exhausted;
        }
        self.pool.most_used = self.pool.most_used.max(self.pool.used + 1);
        let receiver = self.first_blocked(|call| {
            matches!(call, Call::Receive { queue } | Call::ReceiveTimeout { queue, .. } if queue == index)
        });
        let queue = &mut self.queues[index];
        if receiver.is_none() && queue.messages.len() - queue.promised >= queue.room {
            queue.refused = queue.refused.saturating_add(1);
            return Outcome::Full;
        }
        self.pool.used += 1;
        queue.messages.push_back(value);
        if let Some(id) = receiver {
            queue.promised += 1;
            self.wake(id, Activity::Receiving { queue: index });
        }
        Outcome::Nothing
    }

    /// Takes the first message if there is one that is not promised.
    fn receive(&mut self, queue: usize) -> Option<u8> {
        let queue = &mut self.queues[queue];
        if queue.messages.len() == queue.promised { None } else { queue.messages.pop_front() }
    }

    /// Takes the first message. A promise is of one message, not of a certain one.
    pub(super) fn take_promised(&mut self, id: TaskId, queue: usize) {
        let queue = &mut self.queues[queue];
        queue.promised -= 1;
        let message = queue.messages.pop_front();
        self.tasks[id].messages += 1;
        self.tasks[id].activity = Activity::Returning(Outcome::Byte(message));
    }

    pub(super) fn drop_messages(&mut self, id: TaskId) -> Outcome {
        self.pool.used -= std::mem::take(&mut self.tasks[id].messages);
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
    fn disarm(&mut self, timer: usize) -> bool {
        let armed = self.alarms.len();
        self.alarms
            .retain(|alarm| !matches!(alarm.event, Event::Post { timer: other, .. } if other == timer));
        self.alarms.len() < armed
    }

    /// Moves a task's period to its next deadline. Returns the number of those missed if that has passed.
    fn next_deadline(&mut self, id: TaskId) -> Option<Outcome> {
        let now = self.ticks();
        let period = self.tasks[id].period.as_mut().expect("it has started one");
        period.deadline = period.deadline.wrapping_add(period.length);
        if is_ahead(period.deadline.wrapping_sub(now)) {
            return None;
        }
        period.missed = period.missed.saturating_add(1);
        Some(Outcome::Number(period.missed))
    }

    /// After how many ticks a blocked call ends by itself.
    fn longest_wait(&self, id: TaskId, call: Call) -> Option<Ticks> {
        match call {
            Call::WaitTimeout { ticks, .. } | Call::ReceiveTimeout { ticks, .. } => Some(ticks),
            Call::Delay(ticks) | Call::DelayUntil(ticks) => Some(ticks),
            Call::WaitForPeriod => {
                self.tasks[id].period.map(|period| period.deadline.wrapping_sub(self.ticks()))
            }
            _ => None,
        }
    }

    /// What a blocked call returns that has ended by itself.
    pub(super) fn outcome_in_the_end(&self, id: TaskId) -> Outcome {
        match self.tasks[id].activity {
            Activity::Blocked(Call::WaitTimeout { .. } | Call::ReceiveTimeout { .. }) => Outcome::Elapsed,
            Activity::Blocked(Call::DelayUntil(_)) => Outcome::Truth(true),
            Activity::Blocked(Call::WaitForPeriod) => {
                Outcome::Number(self.tasks[id].period.map_or(0, |period| period.missed))
            }
            _ => Outcome::Nothing,
        }
    }
}

/// Whether a deadline so many ticks from now lies in the future.
fn is_ahead(ticks: Ticks) -> bool {
    (1..=LONGEST).contains(&ticks)
}
