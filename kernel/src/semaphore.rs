//! Counting semaphores in two bytes.

use crate::IDLE;
use crate::arch;
use crate::context::{Context, Private, Task};
use crate::link::Link;
use crate::masked::{Masked, MaskedCell};
use crate::ready;
use crate::task::ControlBlock;
#[cfg(not(target_arch = "avr"))]
use crate::walk;
use crate::word::{State, Word};

/// A counting semaphore: up to 255 signals in store, or the tasks that wait for one.
///
/// ```
/// use kernel::Semaphore;
/// static PRESSED: Semaphore = Semaphore::new(0);
/// ```
///
/// Tasks are woken by priority, and in the order in which they came among equals. A signal that finds
/// 255 in store is lost: a semaphore that counts more wants a queue.
#[repr(transparent)]
pub struct Semaphore {
    pub(crate) word: Word,
}

impl Semaphore {
    /// A semaphore with `signals` in store.
    pub const fn new(signals: u8) -> Self {
        Semaphore { word: Word::new(signals) }
    }

    /// Signals: wakes the first waiting task, or stores the signal when none waits.
    ///
    /// Constant in time. Switches at once if the woken task outranks the caller; from an interrupt, at its end.
    #[inline(always)]
    pub fn post(&self, context: &mut impl Context) {
        match context.task(Private) {
            Some(task) => arch::post(self, task),
            // An interrupt, at whose end a switch comes; or there is no task yet.
            None => {
                context.mask(|masked| match self.first(masked) {
                    Some(first) => self.wake(masked, first, false),
                    None => arch::signal(masked, self, false),
                });
            }
        }
    }

    /// Takes a signal, and blocks until there is one.
    #[inline(always)]
    pub fn wait(&self, task: &mut Task) {
        if !self.try_wait(task) {
            arch::wait(self, task);
        }
    }

    /// The same by a call, which preserves what any call does: less flash where not a task's loop waits, but a function that is
    /// called from several places. 10 cycles more where there is a signal, and about 120 where the task blocks.
    #[inline(never)]
    pub fn wait_by_call(&self, task: &mut Task) {
        if !self.try_wait(task) && self.block_until(task, None) == Came::Blocked {
            arch::switch_from_call();
        }
    }

    /// Takes a signal if one is in store, and says whether it did.
    #[inline(always)]
    pub fn try_wait(&self, context: &mut impl Context) -> bool {
        context.mask(|masked| self.take(masked))
    }

    /// Signals. Returns whether another task is to run now. If interrupts `may_strike`, they do so inside, where who waits stands
    /// in for a task.
    #[cfg(not(target_arch = "avr"))]
    pub(crate) fn signal(&self, masked: &Masked, may_strike: bool) -> bool {
        match self.word.get(masked) {
            State::Signals(u8::MAX) => false,
            State::Signals(signals) => {
                self.word.set_signals(masked, signals + 1);
                false
            }
            State::Empty => {
                self.word.reset(masked, 1);
                false
            }
            State::Waiting => self.first(masked).is_some_and(|first| self.wake(masked, first, may_strike)),
        }
    }

    /// Wakes the first waiting task. Returns as [`signal`](Self::signal) does.
    #[inline(always)]
    fn wake(&self, masked: &Masked, first: &'static ControlBlock, may_strike: bool) -> bool {
        self.word.set_link(masked, first.link.get(masked));
        ready::preempt(masked, first) || arch::arrive(masked, first, may_strike)
    }

    /// Wakes the first waiting task, if there is one, that stands for itself. Returns whether it is now the one to run.
    #[inline(always)]
    pub(crate) fn wake_first(&self, masked: &Masked) -> Option<bool> {
        self.first(masked).is_some().then(|| arch::signal(masked, self, false))
    }

    /// Takes a signal if one is in store.
    #[inline(always)]
    pub(crate) fn take(&self, masked: &Masked) -> bool {
        match self.word.get(masked) {
            State::Signals(signals @ 1..) => {
                self.word.set_signals(masked, signals - 1);
                true
            }
            _ => false,
        }
    }

    /// The first waiting task.
    #[inline(always)]
    pub(crate) fn first(&self, masked: &Masked) -> Option<&'static ControlBlock> {
        self.word.first(masked)
    }

    /// Sets what stands first among the waiting tasks, or their end.
    #[inline(always)]
    pub(crate) fn set_first(&self, masked: &Masked, first: Link) {
        self.word.set_link(masked, first);
    }

    /// Makes this the mark of a [`Timeout`](crate::timeout): no task waits as the idle task.
    pub(crate) fn mark_as_timeout(&self, masked: &Masked) {
        self.word.set_link(masked, Link::to(&IDLE));
    }

    /// Whether this is such a mark.
    #[cfg(not(target_arch = "avr"))]
    pub(crate) fn is_timeout(&self, masked: &Masked) -> bool {
        self.first(masked).is_some_and(|first| first.is(&IDLE))
    }

    /// Takes a signal, unless `until` has come; else blocks the task, and a switch is due. All this in one masked section.
    ///
    /// Linear in the number of waiting tasks that this one does not precede, but interrupts are masked for a step at a time.
    pub(crate) fn block_until(&self, task: &mut Task, until: Option<&Until>) -> Came {
        let own = task.mask(ready::running);
        arch::enter_list(self, task, own, until)
    }

    /// Takes a signal; else puts `stand_in` among those that wait. Returns whether it waits.
    ///
    /// Linear likewise.
    pub(crate) fn enlist(&self, task: &mut Task, stand_in: &'static ControlBlock) -> bool {
        arch::enter_list(self, task, stand_in, None) == Came::Blocked
    }
}

#[cfg(not(target_arch = "avr"))]
impl Semaphore {
    /// Takes a signal, unless `until` has come; else has `own` wait, the running task or what stands in for one.
    pub(crate) fn enter(&self, task: &mut Task, own: &'static ControlBlock, until: Option<&Until>) -> Came {
        let block = |masked: &Masked, link| {
            if ready::running(masked).is(own) {
                return ready::block(masked, link);
            }
            walk::end(masked);
            own.link.set(masked, link);
            own
        };
        let mut place = Place { before: None, began_with: None };
        loop {
            let step = task.mask(|masked| {
                let first = match self.word.get(masked) {
                    State::Waiting => self.first(masked),
                    State::Signals(signals @ 1..) => {
                        self.word.set_signals(masked, signals - 1);
                        return Step::Done(Came::Signal);
                    }
                    _ => None,
                };
                if let Some(first) = first
                    && walk::goes_on(masked)
                    && place.began_with.is_some_and(|began_with| began_with.is(first))
                {
                    return self.step(masked, own, first, &mut place, block);
                }
                // Once in a walk: what makes it come ends the walk.
                if until.is_some_and(|until| until.has_come(masked)) {
                    return Step::Done(Came::Until);
                }
                if first.is_some() {
                    walk::begin(masked);
                    place = Place { before: None, began_with: first };
                    return Step::On;
                }
                self.word.set_link(masked, Link::to(block(masked, Link::end_of(self))));
                Step::Done(Came::Blocked)
            });
            if let Step::Done(came) = step {
                return came;
            }
        }
    }

    /// One step of `task` on its way into the list that begins with `first`.
    fn step(
        &self,
        masked: &Masked,
        task: &ControlBlock,
        first: &'static ControlBlock,
        place: &mut Place,
        block: impl Fn(&Masked, Link) -> &'static ControlBlock,
    ) -> Step {
        let link = place.before.map_or(Link::to(first), |before| before.link.get(masked));
        if let Some(next) = link.task()
            && !task.precedes(masked, next)
        {
            place.before = Some(next);
            return Step::On;
        }
        let blocked = block(masked, link);
        match place.before {
            Some(before) => before.link.set(masked, Link::to(blocked)),
            None => self.word.set_link(masked, Link::to(blocked)),
        }
        Step::Done(Came::Blocked)
    }
}

/// What else ends a wait: that of `flags` in `set` enough are set. Whoever sets one ends a walk.
#[repr(C)]
pub(crate) struct Until<'a> {
    set: &'a MaskedCell<u8>,
    pub(crate) flags: u8,
    /// The least value of those that are set.
    pub(crate) least: u8,
}

impl<'a> Until<'a> {
    /// Any of `flags`.
    pub(crate) fn any(set: &'a MaskedCell<u8>, flags: u8) -> Self {
        Until { set, flags, least: 1 }
    }

    /// All of `flags`.
    pub(crate) fn all(set: &'a MaskedCell<u8>, flags: u8) -> Self {
        Until { set, flags, least: flags }
    }

    #[cfg(not(target_arch = "avr"))]
    fn has_come(&self, masked: &Masked) -> bool {
        self.set.get(masked) & self.flags >= self.least
    }
}

/// What came of a wait.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Came {
    /// The task has blocked, and a switch is due.
    Blocked = 0,
    Signal = 1,
    Until = 2,
}

/// How far a task has got in a list of waiting tasks: behind `before`, in the list that began with `began_with`.
#[cfg(not(target_arch = "avr"))]
struct Place {
    before: Option<&'static ControlBlock>,
    began_with: Option<&'static ControlBlock>,
}

/// What came of one step.
#[cfg(not(target_arch = "avr"))]
enum Step {
    On,
    Done(Came),
}
