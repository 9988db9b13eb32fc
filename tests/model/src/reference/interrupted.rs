//! The states that an interrupt may find inside of a call.

use std::{iter, mem};

use kernel::Priority;

use super::calls::deadline;
use super::{Activity, Event, Reference, TaskId};
use crate::call::Call;

impl Reference {
    /// All states that may hold inside of the present call of the running task `id`, in the order of time;
    /// none if another task should run. A task that has blocked still runs until the kernel has found the
    /// next one.
    pub fn interrupted_in_call(&self, id: TaskId) -> Vec<Reference> {
        let mut before = self.clone();
        // The task has blocked, and others still have to make their steps. An interrupt may have woken it
        // behind them.
        let mut ways = Vec::new();
        while before.running() != Some(id) {
            if before.tasks[id].activity != Activity::Own {
                ways.push(before.clone());
            }
            if !before.settle_first() {
                return ways;
            }
        }
        ways.push(before.clone());
        if let Activity::Again(_) = before.tasks[id].activity {
            before.settle_first();
            ways.extend(before.interrupted_in_call(id));
            return ways;
        }
        let mut acted = before.clone();
        if let Activity::Acting(call) = before.tasks[id].activity {
            // The call counts time from here.
            let mut begun = before.clone();
            begun.tasks[id].clock.get_or_insert(before.now);
            // The call has set its end, but the task does not wait yet; or the task is about to wait by
            // proxy.
            let mut timed = begun.clone();
            if call.timeout().is_some_and(|ticks| ticks > 0) {
                timed.tasks[id].is_proxied = true;
                timed.tasks[id].locks |= matches!(call, Call::LockTimeout { .. });
            } else {
                timed.set_end(id, call);
            }
            acted.perform(id, call);
            let halfway = begun.halfway(id, call);
            ways.extend([begun, timed]);
            ways.extend(halfway);
            // A task can't be killed while it starts or kills a task, or tries to.
            let guards = matches!(call, Call::Start { .. } | Call::Kill { .. });
            let guarded = |mut way: Reference| {
                way.tasks[id].is_unkillable = true;
                way
            };
            if guards {
                ways = ways.into_iter().flat_map(|way| [way.clone(), guarded(way)]).collect();
                ways.push(guarded(acted.clone()));
            }
            ways.push(acted.clone());
        }
        // A call of several steps continues, also after the task has blocked and others have run.
        let mut runs = acted.running() == Some(id);
        while acted.settle_first() {
            let ran = mem::replace(&mut runs, acted.running() == Some(id));
            if ran || runs {
                ways.push(acted.clone());
            }
        }
        ways
    }

    /// All states that may hold while the kernel itself runs, on its way to the next task.
    pub fn interrupted_in_kernel(&self) -> Vec<Reference> {
        let mut way = self.clone();
        let mut ways = vec![way.clone()];
        while way.settle_first() {
            ways.push(way.clone());
        }
        ways
    }

    /// All states that may hold inside of a tick: due events happen one after the other. A timer stops
    /// running before its signal is posted.
    pub fn interrupted_at_tick(&self) -> Vec<Reference> {
        let mut way = self.clone();
        let mut ways = vec![way.clone()];
        while let Some(first) = way.first_due() {
            if let Event::Post { timer, .. } = &mut way.alarms[first].event {
                *timer = None;
                ways.push(way.clone());
            }
            way.fire_first();
            ways.push(way.clone());
        }
        ways
    }

    /// The states in which a call of several steps has made some of them.
    fn halfway(&self, id: TaskId, call: Call) -> Vec<Reference> {
        let mut way = self.clone();
        match call {
            // A timer that is restarted is cancelled first. A timer that is due by now is not set: the call
            // posts in its place.
            Call::StartTimer { timer, ticks, semaphore } => {
                way.disarm(timer);
                let cancelled = way.clone();
                way.tasks[id].activity = Activity::Acting(Call::Post { semaphore });
                let is_due = way.tasks[id].clock.is_some_and(|clock| deadline(clock, ticks) <= way.now);
                iter::once(cancelled).chain(is_due.then_some(way)).collect()
            }
            // A stack that a task has left is free for a moment, before the next task has it.
            Call::Start { task } if way.tasks[task].activity == Activity::New => {
                way.tasks[task].priority = Priority::P0;
                vec![way]
            }
            // A message is refused before the refusal is counted.
            Call::SendMade { queue } if way.is_full(queue) => {
                way.tasks[id].activity = Activity::Refused { queue };
                vec![way]
            }
            // A message is appended before it is announced.
            Call::SendMade { queue } => {
                let value = way.tasks[id].made.take().expect("it has made one");
                way.append(queue, value);
                way.tasks[id].activity = Activity::Announcing { queue };
                vec![way]
            }
            // A message is promised before it is taken.
            Call::Receive { queue } | Call::ReceiveTimeout { queue, .. } if way.queues[queue].has_some() => {
                way.queues[queue].promised += 1;
                way.tasks[id].activity = Activity::Receiving { queue };
                vec![way]
            }
            // Messages are dropped one by one.
            Call::DropMessages => iter::from_fn(|| way.drop_message(id).then(|| way.clone())).collect(),
            // The task finds the mutex taken before it waits for it.
            Call::Lock { mutex } | Call::LockTimeout { mutex, .. } if way.mutexes[mutex].is_taken => {
                way.tasks[id].locks = true;
                vec![way]
            }
            // A mutex is handed over before the task leaves its ceiling.
            Call::Unlock => {
                way.hand_over(id);
                way.tasks[id].activity = Activity::Leaving;
                vec![way]
            }
            // Tasks that wait for flags are woken one by one, also a task that has looked in vain and waits
            // again.
            Call::SetFlags(flags) => {
                way.flags |= flags;
                way.tasks[id].activity = Activity::Acting(Call::SetFlags(0));
                let mut ways = vec![way.clone()];
                while way.wake_for_flags() {
                    ways.push(way.clone());
                }
                ways
            }
            _ => Vec::new(),
        }
    }
}
