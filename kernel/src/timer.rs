//! Timers: signals at a later tick, delays, and periods without drift.
//!
//! Armed timers form a list by deadline. A tick only counts down to the first deadline, so it costs the
//! same however many are armed; see [`tick_interrupt!`](crate::tick_interrupt!).

use core::ptr;

use crate::KERNEL;
use crate::context::{Context, Interrupt, Task};
use crate::masked::{Masked, MaskedCell};
use crate::ready;
use crate::semaphore::Semaphore;
use crate::timeout;
use crate::walk;

/// Ticks since the start, modulo 65,536. Whoever drives the tick decides its length: 1 ms on SuperBot's boards.
pub type Ticks = u16;

/// The longest time that can be asked for, in ticks: beyond it past and future can't be told apart.
pub const LONGEST: Ticks = 0x7fff;

/// Ticks until `Timers::next`. A static of its own: the tick's interrupt counts it down in assembly.
#[doc(hidden)]
pub static TICKS_LEFT: MaskedCell<Ticks> = MaskedCell::new(LONGEST);

/// The state of all timers.
pub(crate) struct Timers {
    /// The tick at which the first timer is due, or `LONGEST` from the last one when none is armed.
    next: MaskedCell<Ticks>,
    /// The armed timers, by deadline, in the order of arming among equals.
    first: MaskedCell<Option<&'static Timer>>,
}

impl Timers {
    pub(crate) const fn new() -> Self {
        Timers { next: MaskedCell::new(LONGEST), first: MaskedCell::new(None) }
    }

    /// As at the start.
    #[cfg(not(target_arch = "avr"))]
    pub(crate) fn reset(&self, masked: &Masked) {
        self.first.set(masked, None);
        self.count_down(masked, 0);
    }

    fn now(&self, masked: &Masked) -> Ticks {
        self.next.get(masked).wrapping_sub(TICKS_LEFT.get(masked))
    }

    /// Counts down to the first armed timer, or a long while if there is none.
    fn count_down(&self, masked: &Masked, now: Ticks) {
        let left =
            self.first.get(masked).map_or(LONGEST, |first| first.deadline.get(masked).wrapping_sub(now));
        TICKS_LEFT.set(masked, left);
        self.next.set(masked, now.wrapping_add(left));
    }
}

/// The present tick.
pub fn now(context: &mut impl Context) -> Ticks {
    context.mask(|masked| KERNEL.timers.now(masked))
}

/// A timer that posts a semaphore once.
///
/// ```
/// use kernel::{Semaphore, Timer};
/// static TIMEOUT: Timer = Timer::new();
/// static WAKE: Semaphore = Semaphore::new(0);
/// ```
pub struct Timer {
    link: MaskedCell<Option<&'static Timer>>,
    deadline: MaskedCell<Ticks>,
    /// What to post; `None` while not armed.
    semaphore: MaskedCell<Option<&'static Semaphore>>,
}

impl Default for Timer {
    fn default() -> Self {
        Self::new()
    }
}

impl Timer {
    /// A timer that is not armed.
    pub const fn new() -> Self {
        Timer { link: MaskedCell::new(None), deadline: MaskedCell::new(0), semaphore: MaskedCell::new(None) }
    }

    /// Posts `semaphore` in `ticks` ticks (at least 1, at most [`LONGEST`]; a value outside counts as the nearest).
    /// A timer that is armed is set anew.
    ///
    /// Linear in the number of armed timers, but interrupts are masked for a step at a time only, except in an interrupt.
    pub fn start(&'static self, context: &mut impl Context, ticks: Ticks, semaphore: &'static Semaphore) {
        let deadline = now(context).wrapping_add(ticks.clamp(1, LONGEST));
        loop {
            disarm(context, self);
            // Another task may have armed it just now.
            if arm(context, self, deadline, semaphore) {
                return;
            }
        }
    }

    /// Disarms the timer. Returns whether it was armed; if not, its signal has been posted.
    pub fn cancel(&'static self, context: &mut impl Context) -> bool {
        disarm(context, self)
    }
}

impl Task {
    /// Blocks for `ticks` ticks: from just under that long to that long, as the present tick is under way.
    pub fn delay(&mut self, ticks: Ticks) {
        let deadline = now(self).wrapping_add(ticks.clamp(1, LONGEST));
        self.delay_until(deadline);
    }

    /// Blocks until the tick `deadline`. Returns `false` at once if that has passed.
    pub fn delay_until(&mut self, deadline: Ticks) -> bool {
        if !is_ahead(deadline.wrapping_sub(now(self))) {
            return false;
        }
        let timer = Timer::new();
        let due = Semaphore::new(0);
        // SAFETY: both outlive their use: the wait below returns only after the timer has left the list
        // and posted `due`, and a task's stack is never taken from it.
        let (timer, due) = unsafe { (&*ptr::from_ref(&timer), &*ptr::from_ref(&due)) };
        arm(self, timer, deadline, due);
        due.wait(self);
        true
    }
}

/// A period without drift: each deadline counts from the one before.
pub struct Period {
    deadline: Ticks,
    length: Ticks,
    missed: u16,
}

impl Period {
    /// A period of `length` ticks that starts now.
    pub fn new(task: &mut Task, length: Ticks) -> Self {
        Period { deadline: now(task), length, missed: 0 }
    }

    /// Blocks until the next deadline. One that has passed already is counted as missed, and the wait is over at once.
    pub fn wait(&mut self, task: &mut Task) {
        self.deadline = self.deadline.wrapping_add(self.length);
        if !task.delay_until(self.deadline) {
            self.missed = self.missed.saturating_add(1);
        }
    }

    /// How many deadlines had passed before they were waited for.
    pub fn missed(&self) -> u16 {
        self.missed
    }
}

/// Whether a deadline that many ticks from now lies in the future.
#[inline(always)]
fn is_ahead(ticks: Ticks) -> bool {
    (1..=LONGEST).contains(&ticks)
}

/// What came of one step along the list.
enum Step {
    On(&'static MaskedCell<Option<&'static Timer>>),
    Anew,
    Done(bool),
}

/// Walks along the list until `step` is done. See [`walk`].
#[inline(always)]
fn walk_along(
    context: &mut impl Context,
    step: impl Fn(&Masked, &'static MaskedCell<Option<&'static Timer>>) -> Step,
) -> bool {
    loop {
        let mut slot = &KERNEL.timers.first;
        context.mask(walk::begin);
        loop {
            let came = context.mask(|masked| {
                if !walk::goes_on(masked) {
                    return Step::Anew;
                }
                let came = step(masked, slot);
                if let Step::Done(_) = came {
                    walk::end(masked);
                }
                came
            });
            match came {
                Step::On(next) => slot = next,
                Step::Anew => break,
                Step::Done(result) => return result,
            }
        }
    }
}

/// Changes the list at `slot`.
#[inline(always)]
fn splice(masked: &Masked, slot: &'static MaskedCell<Option<&'static Timer>>, next: Option<&'static Timer>) {
    slot.set(masked, next);
    if ptr::eq(slot, &KERNEL.timers.first) {
        KERNEL.timers.count_down(masked, KERNEL.timers.now(masked));
    }
}

/// Arms `timer`. Returns `false` if it is armed already. Should its deadline come meanwhile, it is as if it had been armed.
#[inline(never)]
pub(crate) fn arm(
    context: &mut impl Context,
    timer: &'static Timer,
    deadline: Ticks,
    semaphore: &'static Semaphore,
) -> bool {
    let is_armed = walk_along(context, |masked, slot| {
        let now = KERNEL.timers.now(masked);
        let ahead = deadline.wrapping_sub(now);
        match slot.get(masked) {
            _ if timer.semaphore.get(masked).is_some() => Step::Done(false),
            _ if !is_ahead(ahead) => {
                fire(masked, semaphore);
                Step::Done(true)
            }
            Some(next) if next.deadline.get(masked).wrapping_sub(now) <= ahead => Step::On(&next.link),
            next => {
                timer.link.set(masked, next);
                timer.deadline.set(masked, deadline);
                timer.semaphore.set(masked, Some(semaphore));
                splice(masked, slot, Some(timer));
                Step::Done(true)
            }
        }
    });
    let is_due = context.mask(ready::is_due);
    context.reschedule(is_due);
    is_armed
}

#[inline(never)]
fn disarm(context: &mut impl Context, timer: &'static Timer) -> bool {
    walk_along(context, |masked, slot| match slot.get(masked) {
        Some(next) if !ptr::eq(next, timer) => Step::On(&next.link),
        Some(_) => {
            timer.semaphore.set(masked, None);
            splice(masked, slot, timer.link.get(masked));
            Step::Done(true)
        }
        None => Step::Done(false),
    })
}

/// Does what a timer that is due does. Returns whether a switch is due.
#[inline(always)]
fn fire(masked: &Masked, semaphore: &'static Semaphore) -> bool {
    if semaphore.is_timeout(masked) { timeout::elapse(masked, semaphore) } else { semaphore.signal(masked) }
}

/// One tick, as the tick's interrupt does it on the AVR in assembly.
#[cfg(not(target_arch = "avr"))]
pub(crate) fn tick(interrupt: &mut Interrupt) {
    let left = interrupt.mask(|masked| {
        let left = TICKS_LEFT.get(masked).wrapping_sub(1);
        TICKS_LEFT.set(masked, left);
        left
    });
    if left == 0 {
        expire();
    }
}

/// What the tick's interrupt does once `left` has run out: posts every semaphore that is due.
#[doc(hidden)]
pub extern "C" fn expire() {
    // SAFETY: only the tick's interrupt calls this, with interrupts masked.
    let interrupt = &mut unsafe { Interrupt::assume() };
    let timers = &KERNEL.timers;
    loop {
        let due = interrupt.mask(|masked| {
            let now = timers.next.get(masked);
            let first = timers.first.get(masked).filter(|first| first.deadline.get(masked) == now)?;
            timers.first.set(masked, first.link.get(masked));
            walk::end(masked);
            let semaphore = first.semaphore.get(masked);
            first.semaphore.set(masked, None);
            semaphore
        });
        let Some(semaphore) = due else { break };
        interrupt.mask(|masked| fire(masked, semaphore));
    }
    interrupt.mask(|masked| timers.count_down(masked, timers.next.get(masked)));
}
