//! Waits for several semaphores, and waits with a timeout, by proxy waiters.
//!
//! A wait with a timeout has one proxy waiter in the queue. So a timer can wake the task without a search,
//! and the task itself removes the proxy waiter from its queue.

use core::ptr;

use crate::arch;
use crate::context::{Context, Task};
use crate::link::Link;
use crate::semaphore::Semaphore;
use crate::timer::{Ticks, Timer, deadline_in};
use crate::wait::{WaitOutcome, WakeCondition};
use crate::wait_set::{ProxyWaiter, WaitSet};

impl WaitSet {
    /// Waits by `proxies`, until the tick `deadline` if there is one. Returns the index of the proxy waiter
    /// whose signal was taken, or of the one that found the wake condition to hold. Returns `None` if the
    /// time is up; no signal was taken then.
    #[inline(never)]
    fn wait(
        &'static self,
        task: &mut Task,
        proxies: &'static [ProxyWaiter],
        condition: Option<&WakeCondition>,
        deadline: Option<Ticks>,
    ) -> Option<usize> {
        let timer = Timer::new();
        // SAFETY: the timer is disarmed before this returns, or when the task is killed.
        let timer: &'static Timer = unsafe { &*ptr::from_ref(&timer) };
        let _clean_up = arch::when_dropped(|| {
            timer.withdraw();
            proxies.iter().for_each(ProxyWaiter::withdraw);
            self.withdraw();
        });
        task.mask(|masked| self.set_proxies(masked, proxies));
        let at_once = proxies.iter().position(|proxy| {
            task.mask(|masked| self.claim(masked, &proxy.control));
            proxy.word.enter(task, &proxy.control, condition) != WaitOutcome::Blocked
        });
        let came = at_once.or_else(|| {
            // If the deadline has passed the timer is not armed, as after it has expired.
            let timer = deadline.map(|deadline| {
                timer.arm_for_task(task, deadline);
                timer
            });
            let signaled = self.receive(task, |masked| timer.is_some_and(|timer| !timer.is_armed(masked)))?;
            proxies.iter().position(|proxy| proxy.control.is(signaled))
        });
        timer.cancel(task);
        for (index, proxy) in proxies.iter().enumerate().take(at_once.unwrap_or(proxies.len())) {
            if Some(index) != came && !proxy.word.expel(task, &proxy.control) {
                proxy.give_back(task);
            }
        }
        self.end(task);
        came
    }
}

impl ProxyWaiter {
    /// Passes on a signal that this proxy waiter was given besides the one that ended the wait. A proxy
    /// waiter that was signaled after the end of the wait has passed it on already.
    fn give_back(&self, task: &mut Task) {
        if task.mask(|masked| self.control.link.get(masked) != Link::NONE) {
            self.word.post(task);
        }
    }
}

/// A wait timed out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Elapsed;

/// Waits for `semaphores`, until the tick `deadline` if there is one. Returns the index of the semaphore that
/// ended the wait.
fn wait_for<const N: usize>(
    task: &mut Task,
    semaphores: [&Semaphore; N],
    condition: Option<&WakeCondition>,
    deadline: Option<Ticks>,
) -> Result<usize, Elapsed> {
    let set = WaitSet::new(task);
    // SAFETY: these borrows end with the wait below, as do the two of `set` and `proxies`. If the task is
    // killed during the wait, its proxy waiters are removed from their queues.
    let proxies = semaphores.map(|semaphore| ProxyWaiter::new(unsafe { &*ptr::from_ref(&semaphore.word) }));
    // SAFETY: before `wait` returns all proxy waiters have left their queues, and the wait set is in no other
    // list.
    let (set, proxies): (&'static WaitSet, &'static [ProxyWaiter]) =
        unsafe { (&*ptr::from_ref(&set), &*ptr::from_ref(proxies.as_slice())) };
    set.wait(task, proxies, condition, deadline).ok_or(Elapsed)
}

impl Semaphore {
    /// Takes a signal, and blocks until there is one, for `ticks` ticks at most. With 0 ticks it does not
    /// block.
    ///
    /// A timeout above [`LONGEST`](crate::LONGEST) counts as `LONGEST`. 23 bytes of stack: 8 for a proxy
    /// waiter, 9 for its wait set, 6 for a timer.
    ///
    /// # Errors
    /// [`Elapsed`] when the time is up. The task has taken no signal then.
    pub fn wait_timeout(&self, task: &mut Task, ticks: Ticks) -> Result<(), Elapsed> {
        if self.try_wait(task) {
            return Ok(());
        }
        if ticks == 0 {
            return Err(Elapsed);
        }
        let deadline = deadline_in(task, ticks);
        self.wait_until(task, deadline, None)
    }

    /// Waits until the tick `deadline`, or until a wake condition holds.
    #[inline(never)]
    pub(crate) fn wait_until(
        &self,
        task: &mut Task,
        deadline: Ticks,
        condition: Option<&WakeCondition>,
    ) -> Result<(), Elapsed> {
        wait_for(task, [self], condition, Some(deadline)).map(|_| ())
    }
}

impl Task {
    /// Takes a signal of one of `semaphores`, and blocks until there is one. Returns its index. Of several
    /// signals it takes the first: in the order of `semaphores` before it blocks, and in the order of arrival
    /// while it is blocked.
    ///
    /// 8 bytes of stack per semaphore, and 15 more. Linear in the number of tasks that wait for them,
    /// preemptible between steps.
    pub fn wait_any<const N: usize>(&mut self, semaphores: [&Semaphore; N]) -> usize {
        self.wait_any_for(semaphores, None).unwrap_or(0)
    }

    /// As [`wait_any`](Self::wait_any), for `ticks` ticks at most: see [`Semaphore::wait_timeout`].
    ///
    /// # Errors
    /// [`Elapsed`] when the time is up. The task has taken no signal then.
    pub fn wait_any_timeout<const N: usize>(
        &mut self,
        semaphores: [&Semaphore; N],
        ticks: Ticks,
    ) -> Result<usize, Elapsed> {
        self.wait_any_for(semaphores, Some(ticks))
    }

    fn wait_any_for<const N: usize>(
        &mut self,
        semaphores: [&Semaphore; N],
        ticks: Option<Ticks>,
    ) -> Result<usize, Elapsed> {
        const { assert!(N > 0, "to wait for nothing has no end: that is `delay`, or `suspend`") };
        if let Some(index) = semaphores.iter().position(|semaphore| semaphore.try_wait(self)) {
            return Ok(index);
        }
        if ticks == Some(0) {
            return Err(Elapsed);
        }
        let deadline = ticks.map(|ticks| deadline_in(self, ticks));
        wait_for(self, semaphores, None, deadline)
    }
}
