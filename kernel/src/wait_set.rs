//! Proxy waiters: they let a task wait for several things, or with a timeout.
//!
//! A task can be in one list only. So if it waits for several semaphores, proxy waiters wait in its place:
//! control blocks without a stack that are always halted. A proxy waiter that is woken joins the task's wait
//! set, and wakes the task if that is blocked.

use core::ptr;

use crate::arch;
use crate::context::{Boot, Context, Task};
use crate::control_block::{ControlBlock, Flag, HALTED};
use crate::critical::{Masked, MaskedCell};
use crate::link::Link;
use crate::ready;
use crate::word::Word;

/// A waiter in a wait queue in place of a task.
#[repr(C)]
pub(crate) struct ProxyWaiter {
    /// First, so that its address is this one's.
    pub(crate) control: ControlBlock,
    pub(crate) word: &'static Word,
}

impl ProxyWaiter {
    pub(crate) const fn new(word: &'static Word) -> ProxyWaiter {
        ProxyWaiter { control: ControlBlock::new(), word }
    }

    /// Removes it from its queue when its task is dropped. If it is a job's, the job is free for another task
    /// then.
    pub(crate) fn withdraw(&'static self) {
        // SAFETY: a run is over, and its tasks are dropped: none runs, and no interrupt comes.
        let boot = &mut unsafe { Boot::assume() };
        self.word.expel(boot, &self.control);
        boot.mask(|masked| self.control.free(masked));
    }
}

/// A task, its proxy waiters, and those of them that have been given a signal.
pub(crate) struct WaitSet {
    /// The last of the ring of the proxy waiters with a signal, in the order of their signals.
    signaled: ready::Last,
    task: &'static ControlBlock,
    /// Whether a timer has ended the wait.
    is_timed_out: MaskedCell<bool>,
    /// The proxy waiters that are removed when the task is killed; none if they are jobs'.
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

    /// Ends the wait set. No proxy waiter may refer to it any more.
    pub(crate) fn end(&self, context: &mut impl Context) {
        context.mask(|masked| self.task.clear_flag(masked, Flag::Proxied));
    }

    /// Ends it for a task that is dropped, or that panicked while it waited and may catch that.
    pub(crate) fn withdraw(&self) {
        // SAFETY: the task panics or is dropped, so no other runs, and no interrupt comes.
        self.end(&mut unsafe { Boot::assume() });
    }

    /// Sets the proxy waiters that are removed when the task is killed.
    pub(crate) fn set_proxies(&self, masked: &Masked, proxies: &'static [ProxyWaiter]) {
        self.proxies.set(masked, proxies);
    }

    /// The proxy waiters that are removed when the task is killed.
    pub(crate) fn proxies(&self, masked: &Masked) -> &'static [ProxyWaiter] {
        self.proxies.get(masked)
    }

    /// Marks the wait as ended by its timer.
    pub(crate) fn time_out(&self, masked: &Masked) {
        self.is_timed_out.set(masked, true);
    }

    /// The wait set of `proxy`.
    pub(crate) fn of(masked: &Masked, proxy: &ControlBlock) -> &'static WaitSet {
        // SAFETY: the control block is a proxy waiter's, so `claim` stored the address of a static there.
        unsafe { &*ptr::with_exposed_provenance(proxy.stack_pointer.get(masked)) }
    }

    /// Adds `proxy` to this set, unless it belongs to one already. Returns whether it did.
    pub(crate) fn claim(&'static self, masked: &Masked, proxy: &'static ControlBlock) -> bool {
        let is_free = proxy.claim(masked);
        if is_free {
            proxy.stack_pointer.set(masked, ptr::from_ref(self).expose_provenance());
            proxy.level.set(masked, HALTED);
            proxy.priority.set(masked, self.task.base(masked) | Flag::Proxy as u8);
        }
        is_free
    }

    /// Gives `proxy`, which has left its queue, a signal. Returns whether another task is the head now, or
    /// `None` if the wait is over: it timed out, or the task was killed.
    pub(crate) fn signal(&self, masked: &Masked, proxy: &'static ControlBlock) -> Option<bool> {
        if self.is_timed_out.get(masked) || self.task.has_flag(masked, Flag::Killed) {
            proxy.link.set(masked, Link::NONE);
            return None;
        }
        self.append(masked, proxy);
        let is_blocked = self.task.link.get(masked) == Link::to_wait_set(self);
        Some(is_blocked && ready::wake(masked, self.task))
    }

    /// Puts `proxy` behind the proxy waiters that were given a signal before.
    #[inline(always)]
    pub(crate) fn append(&self, masked: &Masked, proxy: &'static ControlBlock) {
        ready::enqueue(masked, &self.signaled, proxy);
    }

    /// The first proxy waiter that was given a signal. Blocks until there is one, or until `has_expired`,
    /// which is evaluated in the critical section that blocks: `None` then.
    pub(crate) fn receive(
        &self,
        task: &mut Task,
        has_expired: impl Fn(&Masked) -> bool,
    ) -> Option<&'static ControlBlock> {
        loop {
            let mut is_over = false;
            let blocks = ready::block_unless(task, Link::to_wait_set(self), |masked| {
                let has_signal = self.signaled.kind(masked) != 0;
                is_over = !has_signal && has_expired(masked);
                if is_over {
                    self.time_out(masked);
                }
                has_signal || is_over
            });
            if blocks {
                arch::switch_from_call(task);
            }
            let first = task.mask(|masked| ready::dequeue(masked, &self.signaled));
            if first.is_some() || is_over {
                return first;
            }
        }
    }
}

impl Link {
    /// The link of a task that is blocked by proxy waiters.
    #[inline(always)]
    pub(crate) fn to_wait_set(set: &WaitSet) -> Link {
        Link::end_at(ptr::from_ref(set).cast())
    }

    /// The wait set that blocks `task`, whose link this is.
    pub(crate) fn wait_set(self, masked: &Masked, task: &ControlBlock) -> Option<&'static WaitSet> {
        let object = self.object().filter(|_| task.has_flag(masked, Flag::Proxied))?;
        // SAFETY: a task with this flag is in no wait queue, so `to_wait_set` made it; and the wait set lies
        // on the stack of that task, which does not go on as long as its link is this one.
        Some(unsafe { &*object.cast() })
    }
}
