//! Wait queues: the tasks that wait for a semaphore, by priority, and in the order in which they came among
//! equals.
//!
//! A queue is a list without a tail. Finding a place in it takes time in proportion to its length, in steps:
//! see [`traversal`].

use crate::context::{Context, Task, ThreadContext};
use crate::control_block::{ControlBlock, Flag};
use crate::critical::{Masked, MaskedCell};
use crate::link::Link;
use crate::ready;
use crate::traversal;
use crate::wait_set::WaitSet;
use crate::word::Word;

/// A condition that also ends a wait: those of `flags` that are set in `set` have a value of `least` or more.
/// Setting flags wakes all tasks that wait.
pub(crate) struct WakeCondition<'a> {
    set: &'a MaskedCell<u8>,
    flags: u8,
    /// 1 for any of `flags`, and `flags` for all of them.
    least: u8,
}

impl<'a> WakeCondition<'a> {
    /// Any of `flags`.
    pub(crate) fn any(set: &'a MaskedCell<u8>, flags: u8) -> Self {
        WakeCondition { set, flags, least: 1 }
    }

    /// All of `flags`.
    pub(crate) fn all(set: &'a MaskedCell<u8>, flags: u8) -> Self {
        WakeCondition { set, flags, least: flags }
    }

    fn holds(&self, masked: &Masked) -> bool {
        self.set.get(masked) & self.flags >= self.least
    }
}

/// How a wait began, or ended at once.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum WaitOutcome {
    /// The waiter is in the queue. If it is the running task, a switch is due.
    Blocked,
    /// The waiter has taken a signal.
    Signal,
    /// The wake condition holds.
    Condition,
}

/// How a wait of the running task began.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Wait {
    /// It has taken a signal.
    Over,
    /// It is in the queue, as the first.
    Blocked,
    /// Others wait already: it has to find its place among them.
    Behind,
}

/// The position of a traversal of a wait queue: behind `before`, in the queue that began with `first`.
#[derive(Clone, Copy)]
struct Cursor {
    before: Option<&'static ControlBlock>,
    first: Option<&'static ControlBlock>,
}

impl Cursor {
    fn new() -> Self {
        Cursor { before: None, first: None }
    }

    /// Begins a traversal of the queue that begins with `first`.
    fn begin(&mut self, masked: &Masked, first: &'static ControlBlock) {
        traversal::begin(masked);
        *self = Cursor { before: None, first: Some(first) };
    }

    /// Whether the traversal may continue. An ISR that wakes the first waiter ends it, too.
    #[inline(always)]
    fn is_valid(&self, masked: &Masked, first: &'static ControlBlock) -> bool {
        traversal::is_valid(masked) && self.first.is_some_and(|began_with| began_with.is(first))
    }
}

impl Word {
    /// Wakes the first waiter, or stores the signal if none waits. Returns whether another task is the
    /// head now.
    #[inline(always)]
    pub(crate) fn signal(&self, masked: &Masked) -> bool {
        match self.first(masked) {
            Some(first) => self.wake(masked, first),
            None => {
                self.add_signal(masked, u8::MAX);
                false
            }
        }
    }

    /// [`signal`](Self::signal) as a function call.
    #[inline(never)]
    pub(crate) fn signal_by_call(&self, masked: &Masked) -> bool {
        self.signal(masked)
    }

    /// Signals by a call, and switches if that is due; from an ISR at its end.
    #[inline(always)]
    pub(crate) fn post(&self, context: &mut impl Context) {
        let is_due = context.mask(|masked| self.signal_by_call(masked));
        context.reschedule(is_due);
    }

    /// Wakes `first`, the first waiter. Returns whether another task is the head now.
    #[inline(always)]
    pub(crate) fn wake(&self, masked: &Masked, first: &'static ControlBlock) -> bool {
        self.set_first(masked, first.link.get(masked));
        ready::preempt(masked, first) || self.wake_behind(masked, first)
    }

    /// Wakes the first waiting task, if there is one. Returns whether another task is the head now.
    #[inline(always)]
    pub(crate) fn wake_first(&self, masked: &Masked) -> Option<bool> {
        let first = self.first(masked)?;
        Some(self.wake(masked, first))
    }

    /// [`wake`](Self::wake) for a task or proxy waiter that has left the queue and does not outrank the head.
    /// If its wait is over already, the signal goes to the next waiter.
    #[inline(never)]
    fn wake_behind(&self, masked: &Masked, first: &'static ControlBlock) -> bool {
        let mut waiter = first;
        loop {
            let woken = if waiter.has_flag(masked, Flag::Proxy) {
                WaitSet::of(masked, waiter).signal(masked, waiter)
            } else {
                ready::append(masked, waiter).then_some(false)
            };
            if let Some(is_due) = woken {
                return is_due;
            }
            let Some(next) = self.first(masked) else {
                self.add_signal(masked, u8::MAX);
                return false;
            };
            self.set_first(masked, next.link.get(masked));
            if ready::preempt(masked, next) {
                return true;
            }
            waiter = next;
        }
    }

    /// Takes a signal if there is one. Otherwise, unless `condition` holds, puts `waiter` into the queue: the
    /// running task or a proxy waiter of it. All this happens in one critical section.
    ///
    /// Linear in the number of waiting tasks that this one does not precede, preemptible between steps.
    #[inline(never)]
    pub(crate) fn enter(
        &self,
        task: &mut Task,
        waiter: &'static ControlBlock,
        condition: Option<&WakeCondition>,
    ) -> WaitOutcome {
        let mut cursor = Cursor::new();
        traversal::make(task, |masked| self.enter_step(masked, waiter, condition, &mut cursor))
    }

    /// One step of [`enter`](Self::enter): `None` if there are more.
    #[inline(always)]
    fn enter_step(
        &self,
        masked: &Masked,
        waiter: &'static ControlBlock,
        condition: Option<&WakeCondition>,
        cursor: &mut Cursor,
    ) -> Option<WaitOutcome> {
        let Some(first) = self.first(masked) else {
            return Some(self.enter_first(masked, waiter, condition));
        };
        if !cursor.is_valid(masked, first) {
            // Evaluated once per traversal: setting flags also takes the first waiter from the queue.
            if condition.is_some_and(|condition| condition.holds(masked)) {
                return Some(WaitOutcome::Condition);
            }
            cursor.begin(masked, first);
            return None;
        }
        let next = cursor.before.map_or(Link::to(first), |before| before.link.get(masked));
        if let Some(next) = next.task()
            && !waiter.precedes(masked, next)
        {
            cursor.before = Some(next);
            return None;
        }
        self.insert(masked, waiter, cursor.before, next);
        Some(WaitOutcome::Blocked)
    }

    /// [`enter`](Self::enter) if no task waits.
    #[inline(always)]
    fn enter_first(
        &self,
        masked: &Masked,
        waiter: &'static ControlBlock,
        condition: Option<&WakeCondition>,
    ) -> WaitOutcome {
        if self.take(masked) {
            return WaitOutcome::Signal;
        }
        if condition.is_some_and(|condition| condition.holds(masked)) {
            return WaitOutcome::Condition;
        }
        self.insert(masked, waiter, None, Link::end_of(self));
        WaitOutcome::Blocked
    }

    /// Puts `waiter` between `before`, or the beginning of the queue, and `next`. The running task leaves its
    /// queue of ready tasks.
    #[inline(always)]
    fn insert(
        &self,
        masked: &Masked,
        waiter: &'static ControlBlock,
        before: Option<&'static ControlBlock>,
        next: Link,
    ) {
        if ready::running(masked).is(waiter) {
            ready::leave(masked);
        }
        waiter.link.set(masked, next);
        match before {
            Some(before) => before.link.set(masked, Link::to(waiter)),
            None => self.set_first(masked, Link::to(waiter)),
        }
    }

    /// Begins to wait: takes a signal, or puts the running task into the queue if it is the first there.
    #[inline(always)]
    pub(crate) fn begin_wait(&self, masked: &Masked) -> Wait {
        if self.take(masked) { Wait::Over } else { self.enter_alone(masked) }
    }

    #[inline(never)]
    fn enter_alone(&self, masked: &Masked) -> Wait {
        if self.is_awaited(masked) {
            return Wait::Behind;
        }
        let own = ready::leave(masked);
        own.link.set(masked, Link::end_of(self));
        self.set_first(masked, Link::to(own));
        Wait::Blocked
    }

    /// Continues a wait that is not over. Returns whether the task has blocked, and a switch is due.
    ///
    /// Linear in the number of waiting tasks that this one does not precede, preemptible between steps.
    #[inline(always)]
    fn finish_wait(&self, task: &mut Task, wait: Wait) -> bool {
        match wait {
            Wait::Over => false,
            Wait::Blocked => ready::dispatch(task),
            Wait::Behind => self.wait_behind(task),
        }
    }

    #[inline(never)]
    fn wait_behind(&self, task: &mut Task) -> bool {
        let own = ready::current(task);
        self.enter(task, own, None) == WaitOutcome::Blocked && ready::dispatch(task)
    }

    /// Takes a signal, or blocks the running task. Returns whether it has blocked, and a switch is due.
    #[inline(always)]
    pub(crate) fn block(&self, task: &mut Task) -> bool {
        let wait = task.mask(|masked| self.begin_wait(masked));
        self.finish_wait(task, wait)
    }

    /// [`block`](Self::block), unless `condition` holds.
    pub(crate) fn block_unless(&self, task: &mut Task, condition: &WakeCondition) -> bool {
        let own = ready::current(task);
        self.enter(task, own, Some(condition)) == WaitOutcome::Blocked && ready::dispatch(task)
    }

    /// Removes `waiter` from the queue. Returns whether it was there.
    ///
    /// Linear in the number of waiting tasks, preemptible between steps.
    #[inline(never)]
    pub(crate) fn expel(&self, task: &mut impl ThreadContext, waiter: &'static ControlBlock) -> bool {
        let mut cursor = Cursor::new();
        traversal::make(task, |masked| self.expel_step(masked, waiter, &mut cursor))
    }

    /// One step of [`expel`](Self::expel): `None` if there are more.
    fn expel_step(
        &self,
        masked: &Masked,
        waiter: &'static ControlBlock,
        cursor: &mut Cursor,
    ) -> Option<bool> {
        let Some(first) = self.first(masked) else { return Some(false) };
        let link = waiter.link.get(masked);
        if first.is(waiter) {
            self.set_first(masked, link);
            return Some(true);
        }
        if !cursor.is_valid(masked, first) {
            cursor.begin(masked, first);
        }
        let before = cursor.before.unwrap_or(first);
        match before.link.get(masked).task() {
            Some(next) if next.is(waiter) => {
                before.link.set(masked, link);
                Some(true)
            }
            Some(next) => {
                cursor.before = Some(next);
                None
            }
            None => Some(false),
        }
    }
}

/// Removes `task`, which was killed, from the queue that it waits in, if any.
///
/// Linear in the number of tasks that wait for the same object, preemptible between steps.
pub(crate) fn withdraw(context: &mut impl ThreadContext, task: &'static ControlBlock) {
    while let Some(word) = awaited(context, task) {
        word.expel(context, task);
        context.mask(|masked| task.link.set(masked, Link::PARKED));
    }
}

/// The semaphore that `task`, which was killed, waits for, if any: its queue ends with it.
fn awaited(context: &mut impl ThreadContext, task: &'static ControlBlock) -> Option<&'static Word> {
    let mut cursor: Option<(&'static ControlBlock, Link)> = None;
    traversal::make(context, |masked| {
        // ISRs wake the first waiter only, so none behind `task` leaves before `task` does, and that changes
        // its link.
        let own = task.link.get(masked);
        let before = match cursor {
            Some((before, own_before)) if traversal::is_valid(masked) && own_before == own => before,
            _ => {
                traversal::begin(masked);
                task
            }
        };
        let link = before.link.get(masked);
        let Some(next) = link.task() else {
            return Some(link.word(masked, before));
        };
        cursor = Some((next, own));
        None
    })
}
