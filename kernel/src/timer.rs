//! Timers: signals at a later tick, delays, and periods without drift.
//!
//! Armed timers form a list by deadline. A tick only counts down to the first deadline, so it costs the
//! same however many are armed; see [`tick_interrupt!`](crate::tick_interrupt!).

use core::mem::offset_of;
use core::ops::Range;
use core::ptr;

use crate::arch;
#[cfg(not(target_arch = "avr"))]
use crate::context::Expiry;
use crate::context::{Context, Private, Task, ThreadContext};
use crate::masked::{Masked, MaskedCell};
use crate::semaphore::Semaphore;
use crate::target::Target;
use crate::walk;
use crate::{KERNEL, Kernel};

/// Ticks since the start, modulo 65,536. Whoever drives the tick decides its length: 1 ms on SuperBot's boards.
pub type Ticks = u16;

/// The longest time that can be asked for, in ticks: beyond it past and future can't be told apart.
pub const LONGEST: Ticks = 0x7fff;

/// Ticks until `Timers::next`. A static of its own: the tick's interrupt counts it down in assembly.
#[doc(hidden)]
pub static TICKS_LEFT: MaskedCell<Ticks> = MaskedCell::new(LONGEST);

/// The present tick, counted by the tick's interrupt.
pub static TICKS: MaskedCell<Ticks> = MaskedCell::new(0);

/// Where `Timers::next` lies in the kernel's state: less the ticks left it is the present tick, for vectors that need it.
#[doc(hidden)]
pub const NEXT: usize = offset_of!(Kernel, timers.next);

/// The state of all timers.
pub(crate) struct Timers {
    /// The tick at which the first timer is due, or `LONGEST` from the last one when none is armed.
    pub(crate) next: MaskedCell<Ticks>,
    /// The armed timers, by deadline, in the order of arming among equals.
    pub(crate) first: MaskedCell<Option<&'static Timer>>,
}

impl Timers {
    pub(crate) const fn new() -> Self {
        Timers { next: MaskedCell::new(LONGEST), first: MaskedCell::new(None) }
    }

    /// As at the start.
    #[cfg(not(target_arch = "avr"))]
    pub(crate) fn reset(&self, masked: &Masked) {
        self.first.set(masked, None);
        self.next.set(masked, LONGEST);
        TICKS_LEFT.set(masked, LONGEST);
    }

    pub(crate) fn now(&self, masked: &Masked) -> Ticks {
        self.next.get(masked).wrapping_sub(TICKS_LEFT.get(masked))
    }

    /// Counts down to `first`, or a long while if there is none. Returns whether that is ahead.
    #[inline(always)]
    fn count_down(&self, masked: &Masked, first: Option<&Timer>) -> bool {
        let before = self.next.get(masked);
        let next = match first {
            Some(first) => first.deadline.get(masked),
            None => before.wrapping_add(LONGEST),
        };
        let left = TICKS_LEFT.get(masked).wrapping_add(next.wrapping_sub(before));
        self.next.set(masked, next);
        TICKS_LEFT.set(masked, left);
        is_ahead(left)
    }

    /// Counts down to `deadline`. `false`, with nothing done, if that is not ahead.
    #[inline(always)]
    fn count_to(&self, masked: &Masked, deadline: Ticks) -> bool {
        let left = TICKS_LEFT.get(masked).wrapping_add(deadline.wrapping_sub(self.next.get(masked)));
        let is_ahead = is_ahead(left);
        if is_ahead {
            self.next.set(masked, deadline);
            TICKS_LEFT.set(masked, left);
        }
        is_ahead
    }
}

/// The present tick.
pub fn now(context: &mut impl Context) -> Ticks {
    context.now()
}

/// A timer that posts a semaphore once.
///
/// ```
/// use kernel::{Semaphore, Timer};
/// static TIMEOUT: Timer = Timer::new();
/// static WAKE: Semaphore = Semaphore::new(0);
/// ```
#[repr(C)]
pub struct Timer {
    pub(crate) link: MaskedCell<Option<&'static Timer>>,
    pub(crate) deadline: MaskedCell<Ticks>,
    /// What to wake; nothing while not armed.
    pub(crate) target: MaskedCell<Target>,
}

impl Default for Timer {
    fn default() -> Self {
        Self::new()
    }
}

impl Timer {
    /// A timer that is not armed.
    pub const fn new() -> Self {
        Timer {
            link: MaskedCell::new(None),
            deadline: MaskedCell::new(0),
            target: MaskedCell::new(Target::NOTHING),
        }
    }

    /// Posts `semaphore` in `ticks` ticks (at least 1, at most [`LONGEST`]; a value outside counts as the nearest).
    /// A timer that is armed is set anew.
    ///
    /// Linear in the number of armed timers, but interrupts are masked for a step at a time only.
    pub fn start(
        &'static self,
        context: &mut impl ThreadContext,
        ticks: Ticks,
        semaphore: &'static Semaphore,
    ) {
        let deadline = now(context).wrapping_add(ticks.clamp(1, LONGEST));
        if !arm(context, self, deadline, Target::semaphore(semaphore)) {
            semaphore.post(context);
        }
    }

    /// Disarms the timer. Returns whether it was armed; if not, its signal has been posted.
    pub fn cancel(&'static self, context: &mut impl ThreadContext) -> bool {
        match context.task(Private) {
            Some(task) => arch::disarm(task, self),
            None => self.is_running(context) && disarm_first(context, |next| ptr::eq(next, self)),
        }
    }

    /// Whether the timer is armed.
    pub fn is_running(&self, context: &mut impl Context) -> bool {
        context.mask(|masked| self.is_armed(masked))
    }

    pub(crate) fn is_armed(&self, masked: &Masked) -> bool {
        !self.target.get(masked).is_nothing()
    }
}

impl Task {
    /// Blocks for `ticks` ticks: from just under that long to that long, as the present tick is under way.
    #[inline(always)]
    pub fn delay(&mut self, ticks: Ticks) {
        let deadline = now(self).wrapping_add(ticks.clamp(1, LONGEST));
        self.delay_until(deadline);
    }

    /// Blocks until the tick `deadline`. Returns `false` at once if that has passed.
    #[inline(always)]
    pub fn delay_until(&mut self, deadline: Ticks) -> bool {
        arch::delay_until(self, deadline)
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

/// What came of one step along the list; see [`walk`].
enum Step<R> {
    On(&'static MaskedCell<Option<&'static Timer>>),
    Done(R),
}

/// Arms `timer`, anew if it is armed. `false`, with nothing done, if `deadline` has passed.
#[inline(always)]
pub(crate) fn arm(
    context: &mut impl ThreadContext,
    timer: &'static Timer,
    deadline: Ticks,
    target: Target,
) -> bool {
    match context.task(Private) {
        Some(task) => arch::arm(task, timer, deadline, target),
        None => arm_by_steps(context, timer, deadline, target),
    }
}

/// The same where it is not done in assembly.
pub(crate) fn arm_by_steps(
    context: &mut impl ThreadContext,
    timer: &'static Timer,
    deadline: Ticks,
    target: Target,
) -> bool {
    let mut slot: Option<&'static MaskedCell<Option<&'static Timer>>> = None;
    loop {
        let came = context.mask(|masked| {
            let slot = match slot {
                Some(slot) if walk::goes_on(masked) => slot,
                _ => {
                    // Once in a walk: whoever arms it meanwhile ends the walk.
                    if timer.is_armed(masked) {
                        return Step::Done(Arming::Already);
                    }
                    if !is_ahead(deadline.wrapping_sub(KERNEL.timers.now(masked))) {
                        return Step::Done(Arming::Passed);
                    }
                    timer.deadline.set(masked, deadline);
                    walk::begin(masked);
                    return Step::On(&KERNEL.timers.first);
                }
            };
            let next = slot.get(masked);
            match next {
                // Both are ahead, so the difference of the two tells which is first.
                Some(next) if !is_ahead(next.deadline.get(masked).wrapping_sub(deadline)) => {
                    return Step::On(&next.link);
                }
                _ => {}
            }
            walk::end(masked);
            if ptr::eq(slot, &KERNEL.timers.first) && !KERNEL.timers.count_to(masked, deadline) {
                return Step::Done(Arming::Passed);
            }
            slot.set(masked, Some(timer));
            timer.link.set(masked, next);
            timer.target.set(masked, target);
            Step::Done(Arming::Done)
        });
        match came {
            Step::On(next) => slot = Some(next),
            Step::Done(Arming::Done) => return true,
            Step::Done(Arming::Passed) => return false,
            Step::Done(Arming::Already) => {
                disarm_first(context, |next| ptr::eq(next, timer));
                slot = None;
            }
        }
    }
}

/// What came of arming a timer.
#[derive(Clone, Copy)]
enum Arming {
    Done,
    /// It is armed.
    Already,
    /// The deadline has.
    Passed,
}

/// Disarms all timers that lie in `memory`.
pub(crate) fn disarm_within(context: &mut impl ThreadContext, memory: Range<usize>) {
    while match context.task(Private) {
        Some(task) => arch::disarm_within(task, memory.clone()),
        None => disarm_first(context, |next| memory.contains(&ptr::from_ref(next).addr())),
    } {}
}

/// Disarms the first timer that `is_it` says. Returns whether there was one.
#[inline(always)]
pub(crate) fn disarm_first(context: &mut impl ThreadContext, is_it: impl Fn(&Timer) -> bool) -> bool {
    let mut slot: Option<&'static MaskedCell<Option<&'static Timer>>> = None;
    loop {
        let came = context.mask(|masked| {
            let slot = match slot {
                Some(slot) if walk::goes_on(masked) => slot,
                _ => {
                    walk::begin(masked);
                    &KERNEL.timers.first
                }
            };
            let timer = match slot.get(masked) {
                Some(next) if !is_it(next) => return Step::On(&next.link),
                Some(next) => next,
                None => {
                    walk::end(masked);
                    return Step::Done(false);
                }
            };
            walk::end(masked);
            let link = timer.link.get(masked);
            slot.set(masked, link);
            timer.target.set(masked, Target::NOTHING);
            if ptr::eq(slot, &KERNEL.timers.first) {
                KERNEL.timers.count_down(masked, link);
            }
            Step::Done(true)
        });
        match came {
            Step::On(next) => slot = Some(next),
            Step::Done(result) => return result,
        }
    }
}

/// One tick, as the tick's interrupt does it on the AVR in assembly.
#[cfg(not(target_arch = "avr"))]
pub(crate) fn tick(interrupt: &mut crate::Interrupt) {
    let left = interrupt.mask(|masked| {
        TICKS.set(masked, TICKS.get(masked).wrapping_add(1));
        let left = TICKS_LEFT.get(masked).wrapping_sub(1);
        TICKS_LEFT.set(masked, left);
        left
    });
    if left == 0 {
        while expire() {}
    }
}

/// What the tick's interrupt does, on the AVR in assembly, once `TICKS_LEFT` has run out: wakes what the first timer is to
/// wake. Returns whether another one is due. Until none is, `TICKS_LEFT` is not positive, so that no tick comes here as well.
///
/// In three sections, with interrupts enabled in between: no task runs meanwhile, and interrupts leave timers alone.
#[cfg(not(target_arch = "avr"))]
pub(crate) fn expire() -> bool {
    // SAFETY: only the tick's interrupt calls this, with interrupts masked.
    let expiry = &mut unsafe { Expiry::assume() };
    let timers = &KERNEL.timers;
    let target = expiry.mask(|masked| {
        let Some(first) = timers.first.get(masked) else { return Target::NOTHING };
        timers.first.set(masked, first.link.get(masked));
        walk::end(masked);
        first.target.replace(masked, Target::NOTHING)
    });
    target.wake(expiry);
    expiry.peek(|masked| !timers.count_down(masked, timers.first.get(masked)))
}
