//! Steps that show the final state: they empty every object and end every wait.

use super::{Activity, Queue, Reference, Waiter};
use crate::call::{BUFFERS, Call, Object};
use crate::step::{Handler, Step};

impl Reference {
    /// The next of these steps, while no task runs.
    pub fn leftover(&self) -> Option<Step> {
        let call =
            self.object_to_empty().or_else(|| self.task_to_resume()).or_else(|| self.call_to_end_a_wait());
        call.map(|call| Step::Interrupt(Handler::Calls(vec![call]))).or_else(|| {
            let next = self.alarms.iter().map(|alarm| alarm.deadline - self.now).min();
            next.map(|ticks| Step::Silence(ticks as u16))
        })
    }

    fn object_to_empty(&self) -> Option<Call> {
        let semaphore = self.semaphores.iter().position(|&signals| signals > 0);
        let queue = self.queues.iter().position(Queue::has_some);
        None.or(semaphore.map(|semaphore| Call::TryWait { semaphore }))
            .or(queue.map(|queue| Call::TryReceive { queue }))
            .or((self.flags != 0).then_some(Call::TakeFlags(0xff)))
            .or((!self.fifo.is_empty()).then_some(Call::FifoTake))
            .or((self.pipe.bytes > 0).then_some(Call::PipeTryTake))
    }

    fn task_to_resume(&self) -> Option<Call> {
        let task = self.tasks.iter().position(|task| task.is_suspended)?;
        Some(Call::Resume { task })
    }

    fn call_to_end_a_wait(&self) -> Option<Call> {
        self.tasks.iter().find_map(|task| match task.activity {
            Activity::Blocked(Call::Wait { semaphore } | Call::WaitTimeout { semaphore, .. }) => {
                self.post_for_task(semaphore)
            }
            Activity::Blocked(
                Call::WaitForSeveral { semaphores } | Call::WaitForSeveralTimeout { semaphores, .. },
            ) => semaphores.into_iter().find_map(|semaphore| self.post_for_task(semaphore)),
            // A task that stays blocked may hold all messages.
            Activity::Blocked(Call::Receive { queue } | Call::ReceiveTimeout { queue, .. })
                if self.pool.used < BUFFERS =>
            {
                Some(Call::Send { queue, value: 0 })
            }
            Activity::Blocked(
                Call::WaitAny(1..)
                | Call::WaitAll(_)
                | Call::WaitAnyTimeout { flags: 1.., .. }
                | Call::WaitAllTimeout { .. },
            ) => Some(Call::SetFlags(0xff)),
            Activity::Blocked(Call::PipeTake | Call::PipeTakeTimeout { .. }) if self.pipe.space > 0 => {
                Some(Call::PipeTryPut(0))
            }
            _ => None,
        })
    }

    /// A signal for a task; none if a job would take it, because the job may wait ahead of the task again and
    /// again.
    fn post_for_task(&self, semaphore: usize) -> Option<Call> {
        let is_for_job = match self.first_in_line(Object::Semaphore(semaphore))? {
            Waiter::Member(id, member) => self.is_job(id, member),
            Waiter::Task(_) | Waiter::Void(_) => false,
        };
        (!is_for_job).then_some(Call::Post { semaphore })
    }
}
