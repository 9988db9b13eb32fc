//! Proxy waiters: a task that waits for several things, or for a limited time.
//!
//! A task can be in one list only. So where it waits for several semaphores, proxy waiters wait in its place:
//! control blocks without a stack that are always halted. One that is woken joins the task's wait set, and
//! wakes the task if that is blocked. A wait with a timeout has one proxy waiter: the timer can wake the task
//! at once, and the task itself takes the proxy waiter from its queue.

use core::ptr;

use crate::arch;
use crate::context::{Context, Task};
use crate::control_block::{ControlBlock, Flag, HALTED};
use crate::critical::{Masked, MaskedCell};
use crate::link::Link;
use crate::ready;
use crate::semaphore::Semaphore;
use crate::timer::{LONGEST, Ticks, Timer, now};
use crate::wait::{WaitOutcome, WakeCondition};

/// What waits for `semaphore` in place of a task.
#[repr(C)]
pub(crate) struct ProxyWaiter {
    /// First, so that its address is this one's.
    pub(crate) control: ControlBlock,
    pub(crate) semaphore: &'static Semaphore,
}

impl ProxyWaiter {
    pub(crate) const fn new(semaphore: &'static Semaphore) -> ProxyWaiter {
        ProxyWaiter { control: ControlBlock::new(), semaphore }
    }
}

/// A task, its proxy waiters, and those of them that have been given a signal.
pub(crate) struct WaitSet {
    /// The last of the ring of those, in the order of their signals.
    signaled: ready::Last,
    task: &'static ControlBlock,
    /// A timer has ended the wait.
    is_timed_out: MaskedCell<bool>,
    /// Those that a task which is killed takes with it; jobs have none of these.
    proxies: MaskedCell<&'static [ProxyWaiter]>,
}

impl WaitSet {
    /// A wait set of the running task, until [`end`](Self::end).
    pub(crate) fn new(task: &mut Task) -> WaitSet {
        let task = task.mask(|masked| {
            let task = ready::running(masked);
            task.set_flag(masked, Flag::Proxied);
            task
        });
        WaitSet {
            signaled: ready::Last::new(Link::NONE),
            task,
            is_timed_out: MaskedCell::new(false),
            proxies: MaskedCell::new(&[]),
        }
    }

    /// No proxy waiter refers to the wait set any more.
    pub(crate) fn end(&self, task: &mut Task) {
        task.mask(|masked| self.task.clear_flag(masked, Flag::Proxied));
    }

    /// Those of a wait set that may be killed with its task.
    pub(crate) fn proxies(&self, masked: &Masked) -> &'static [ProxyWaiter] {
        self.proxies.get(masked)
    }

    /// The timer of the wait has expired, and the task is blocked.
    pub(crate) fn time_out(&self, masked: &Masked) {
        self.is_timed_out.set(masked, true);
    }

    /// The wait set of `proxy`.
    pub(crate) fn of(masked: &Masked, proxy: &ControlBlock) -> &'static WaitSet {
        // SAFETY: the control block is a proxy waiter's, so `claim` stored this, made from a static.
        unsafe { &*ptr::with_exposed_provenance(proxy.stack_pointer.get(masked)) }
    }

    /// Makes `proxy` one of this set, unless it is one of another. Returns whether it did.
    pub(crate) fn claim(&'static self, masked: &Masked, proxy: &'static ControlBlock) -> bool {
        let is_free = proxy.claim(masked);
        if is_free {
            proxy.stack_pointer.set(masked, ptr::from_ref(self).expose_provenance());
            proxy.level.set(masked, HALTED);
            proxy.priority.set(masked, self.task.base(masked) | Flag::Proxy as u8);
        }
        is_free
    }

    /// `proxy` is given a signal, and has left its queue. Returns whether another task is the head now, or
    /// `None` if the wait is over: its time was up, or the task was killed.
    pub(crate) fn signal(&self, masked: &Masked, proxy: &'static ControlBlock) -> Option<bool> {
        if self.is_timed_out.get(masked) || self.task.has_flag(masked, Flag::Killed) {
            proxy.link.set(masked, Link::NONE);
            return None;
        }
        self.append(masked, proxy);
        let is_blocked = self.task.link.get(masked) == Link::to_wait_set(self);
        Some(is_blocked && ready::wake(masked, self.task))
    }

    /// Puts `proxy` behind those that were given a signal.
    #[inline(always)]
    pub(crate) fn append(&self, masked: &Masked, proxy: &'static ControlBlock) {
        ready::enqueue(masked, &self.signaled, proxy);
    }

    /// The first that was given a signal; blocks until there is one, or until `timer` has expired: `None`
    /// then.
    pub(crate) fn receive(&self, task: &mut Task, timer: Option<&Timer>) -> Option<&'static ControlBlock> {
        loop {
            let mut has_expired = false;
            let blocks = ready::block_unless(task, Link::to_wait_set(self), |masked| {
                let has_signal = self.signaled.kind(masked) != 0;
                has_expired = !has_signal && timer.is_some_and(|timer| !timer.is_armed(masked));
                if has_expired {
                    self.time_out(masked);
                }
                has_signal || has_expired
            });
            if blocks {
                arch::switch_from_call(task);
            }
            let first = task.mask(|masked| ready::dequeue(masked, &self.signaled));
            if first.is_some() || has_expired {
                return first;
            }
        }
    }

    /// Waits by `proxies`, until the tick `deadline` if there is one. Returns the index of the proxy waiter
    /// whose signal was taken, or of the one whose wake condition holds. If the time is up, no signal was
    /// taken.
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
        task.mask(|masked| self.proxies.set(masked, proxies));
        let at_once = proxies.iter().position(|proxy| {
            task.mask(|masked| self.claim(masked, &proxy.control));
            proxy.semaphore.enter(task, &proxy.control, condition) != WaitOutcome::Blocked
        });
        let came = at_once.or_else(|| {
            // A deadline that has passed leaves the timer as one that has expired.
            let timer = deadline.map(|deadline| {
                timer.arm_for_task(task, deadline);
                timer
            });
            let signaled = self.receive(task, timer)?;
            proxies.iter().position(|proxy| proxy.control.is(signaled))
        });
        timer.cancel(task);
        for (index, proxy) in proxies.iter().enumerate().take(at_once.unwrap_or(proxies.len())) {
            if Some(index) != came && !proxy.semaphore.expel(task, &proxy.control) {
                proxy.give_back(task);
            }
        }
        self.end(task);
        came
    }
}

impl ProxyWaiter {
    /// Passes on the signal that this was given besides the one that ended the wait. One whose wait was over
    /// has done so.
    fn give_back(&self, task: &mut Task) {
        if task.mask(|masked| self.control.link.get(masked) != Link::NONE) {
            self.semaphore.post(task);
        }
    }
}

/// The time of a wait was up before what it waited for came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Elapsed;

/// Waits for `semaphores`, for `ticks` ticks at most where a number is given. Returns the index of the one
/// that came.
fn wait_for<const N: usize>(
    task: &mut Task,
    semaphores: [&Semaphore; N],
    condition: Option<&WakeCondition>,
    ticks: Option<Ticks>,
) -> Result<usize, Elapsed> {
    let set = WaitSet::new(task);
    // SAFETY: these borrows end with the wait below, as the two of `set` and `proxies` do. A task that is
    // killed in there takes its proxy waiters with it.
    let proxies = semaphores.map(|semaphore| ProxyWaiter::new(unsafe { &*ptr::from_ref(semaphore) }));
    // SAFETY: before `wait` returns all proxy waiters have left their queues, and the wait set is in no other
    // list.
    let (set, proxies): (&'static WaitSet, &'static [ProxyWaiter]) =
        unsafe { (&*ptr::from_ref(&set), &*ptr::from_ref(proxies.as_slice())) };
    let deadline = ticks.map(|ticks| now(task).wrapping_add(ticks.min(LONGEST)));
    set.wait(task, proxies, condition, deadline).ok_or(Elapsed)
}

impl Semaphore {
    /// Takes a signal, and blocks until there is one, for `ticks` ticks at most. With 0 ticks it does not
    /// block.
    ///
    /// A time above [`LONGEST`] counts as that. 23 bytes of stack: 8 for a proxy waiter, 9 for its wait set,
    /// 6 for a timer.
    ///
    /// # Errors
    /// [`Elapsed`] when the time is up. The task has taken no signal then.
    pub fn wait_timeout(&self, task: &mut Task, ticks: Ticks) -> Result<(), Elapsed> {
        if self.try_wait(task) {
            return Ok(());
        }
        self.wait_for_condition(task, None, ticks)
    }

    /// The same, which a wake condition ends, too.
    #[inline(never)]
    pub(crate) fn wait_for_condition(
        &self,
        task: &mut Task,
        condition: Option<&WakeCondition>,
        ticks: Ticks,
    ) -> Result<(), Elapsed> {
        if ticks == 0 {
            return Err(Elapsed);
        }
        wait_for(task, [self], condition, Some(ticks)).map(|_| ())
    }
}

impl Task {
    /// Takes a signal of one of `semaphores`, and blocks until there is one; of several the first. Returns
    /// its index.
    ///
    /// 8 bytes of stack a semaphore, and 15. Linear in the number of tasks that wait for them, in steps.
    pub fn wait_any<const N: usize>(&mut self, semaphores: [&Semaphore; N]) -> usize {
        self.wait_any_for(semaphores, None).unwrap_or(0)
    }

    /// The same for `ticks` ticks at most: see [`Semaphore::wait_timeout`].
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
        if let Some(index) = semaphores.iter().position(|semaphore| semaphore.try_wait(self)) {
            return Ok(index);
        }
        if ticks == Some(0) {
            return Err(Elapsed);
        }
        wait_for(self, semaphores, None, ticks)
    }
}
