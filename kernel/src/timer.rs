//! Timers: signals at a later tick, delays, and periods without drift.
//!
//! Armed timers form a list, by deadline. A tick increments the present tick and compares it with the first
//! deadline, so it costs the same however many timers are armed; see `tick_interrupt!`.

use core::ptr;

use crate::KERNEL;
use crate::arch;
use crate::context::{Boot, Context, Interrupt, Task, ThreadContext};
use crate::control_block::ControlBlock;
use crate::critical::{KernelCell, Masked, MaskedCell};
use crate::link::{END, Link};
use crate::ready;
use crate::semaphore::Semaphore;
use crate::traversal;

/// Ticks since the start, modulo 65,536. The interrupt that drives the tick sets its length: 1 ms on
/// SuperBot's boards.
pub type Ticks = u16;

/// The longest time from now to a deadline, in ticks: beyond it past and future can't be told apart.
pub const LONGEST: Ticks = 0x7fff;

/// Whether `now` is the tick `deadline` or a later one, for two that lie at most [`LONGEST`] apart.
///
/// ```
/// use kernel::is_reached;
/// assert!(is_reached(65_530, 65_530) && is_reached(65_530, 4) && !is_reached(4, 65_530));
/// ```
#[inline(always)]
pub const fn is_reached(deadline: Ticks, now: Ticks) -> bool {
    now.wrapping_sub(deadline) <= LONGEST
}

/// The present tick. A static of its own, as the tick's vector counts it; other vectors may read it.
///
/// ```compile_fail,E0624
/// # use kernel::{Context, TICKS, Task};
/// fn body(task: &mut Task) {
///     task.mask(|masked| TICKS.set(masked, 0)); // error: method `set` is private
/// }
/// ```
pub static TICKS: KernelCell<Ticks> = KernelCell::new(0);

/// The deadline of the first timer, at which the tick enters the kernel like any other interrupt. While
/// timers expire, and if none is armed, it lies in the past, or is the present tick. A static of its own, as
/// the tick's vector compares it.
#[doc(hidden)]
pub static NEXT_DEADLINE: KernelCell<Ticks> = KernelCell::new(Ticks::MAX);

/// A link to a timer; that of a list leads to its first.
type Slot = MaskedCell<Option<&'static Timer>>;

/// The armed timers, by deadline, in the order of arming among equals.
pub(crate) struct Timers {
    first: Slot,
}

impl Timers {
    pub(crate) const fn new() -> Self {
        Timers { first: MaskedCell::new(None) }
    }

    /// Restores the initial state.
    #[allow(dead_code, reason = "a port for tests starts the kernel again and again")]
    pub(crate) fn reset(&self, masked: &Masked) {
        while let Some(first) = self.first.get(masked) {
            self.first.set(masked, first.link.get(masked));
            first.target.set(masked, Target::NOTHING);
        }
        TICKS.set(masked, 0);
        NEXT_DEADLINE.set(masked, Ticks::MAX);
    }
}

/// The present tick.
pub fn now(context: &mut impl Context) -> Ticks {
    context.mask(|masked| TICKS.get(masked))
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
    link: Slot,
    deadline: MaskedCell<Ticks>,
    /// What to wake; nothing while not armed.
    target: MaskedCell<Target>,
}

/// A semaphore to post, a blocked task to wake, or nothing. The highest bit, which is clear in all addresses
/// of RAM, marks a task.
#[derive(Clone, Copy)]
#[repr(transparent)]
struct Target(*const Semaphore);

// SAFETY: what it points to is `Sync`.
unsafe impl Send for Target {}

impl Target {
    const NOTHING: Target = Target(ptr::null());

    fn semaphore(semaphore: &'static Semaphore) -> Target {
        Target(semaphore)
    }

    fn task(task: &'static ControlBlock) -> Target {
        Target(ptr::with_exposed_provenance(ptr::from_ref(task).expose_provenance() | END))
    }

    #[inline(always)]
    fn is_nothing(self) -> bool {
        self.0.is_null()
    }

    #[inline(always)]
    fn is_task(self) -> bool {
        self.0.addr() & END != 0
    }

    /// The task of a target that is one.
    #[inline(always)]
    fn as_task(self) -> &'static ControlBlock {
        debug_assert!(self.is_task());
        // SAFETY: `task` made it from a static.
        unsafe { &*ptr::with_exposed_provenance(self.0.addr() & !END) }
    }

    /// The semaphore of a target that is not a task.
    #[inline(always)]
    fn as_semaphore(self) -> Option<&'static Semaphore> {
        // SAFETY: null, or `semaphore` made it from a static.
        unsafe { self.0.as_ref() }
    }
}

impl Target {
    /// Posts the semaphore, or ends the task's wait with a timeout, if the task is still blocked in it.
    #[inline(never)]
    fn end_wait(self, masked: &Masked) {
        if !self.is_task() {
            if let Some(semaphore) = self.as_semaphore() {
                semaphore.word.signal_by_call(masked);
            }
            return;
        }
        let task = self.as_task();
        if let Some(set) = task.link.get(masked).wait_set(masked, task) {
            set.time_out(masked);
            ready::wake(masked, task);
        }
    }
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

    /// Posts `semaphore` in `ticks` ticks, from 1 to [`LONGEST`]: a larger number counts as `LONGEST`, and 0
    /// posts at once. A timer that is armed is restarted.
    ///
    /// Linear in the number of armed timers, preemptible between steps.
    pub fn start(
        &'static self,
        context: &mut impl ThreadContext,
        ticks: Ticks,
        semaphore: &'static Semaphore,
    ) {
        let deadline = deadline_in(context, ticks);
        if !self.arm(context, deadline, Target::semaphore(semaphore)) {
            arch::irq_window();
            semaphore.post(context);
        }
    }

    /// Disarms the timer. Returns whether it was armed. If not, its signal has been posted since it was
    /// started, or another call has disarmed it.
    ///
    /// Linear in the number of armed timers, preemptible between steps.
    pub fn cancel(&'static self, context: &mut impl ThreadContext) -> bool {
        self.is_running(context) && self.disarm(context)
    }

    /// Whether the timer is armed.
    pub fn is_running(&self, context: &mut impl Context) -> bool {
        context.mask(|masked| self.is_armed(masked))
    }

    #[inline(always)]
    pub(crate) fn is_armed(&self, masked: &Masked) -> bool {
        !self.target.get(masked).is_nothing()
    }

    /// Arms the timer to wake the running task if that is [blocked](Link::DELAYED) by then. Returns `false`,
    /// with nothing done, if `deadline` has passed.
    #[inline(never)]
    pub(crate) fn arm_for_task(&'static self, task: &mut Task, deadline: Ticks) -> bool {
        let target = task.mask(|masked| Target::task(ready::running(masked)));
        self.arm(task, deadline, target)
    }

    /// Arms the timer; disarms it first if it is armed. Returns `false`, with the timer not armed, if
    /// `deadline` has passed.
    fn arm(&'static self, context: &mut impl ThreadContext, deadline: Ticks, target: Target) -> bool {
        arch::need_tick();
        let mut cursor = Cursor::new();
        loop {
            match context.mask(|masked| self.arm_step(masked, &mut cursor, deadline, target)) {
                Some(Arming::Done) => return true,
                Some(Arming::Passed) => return false,
                Some(Arming::Armed) => {
                    self.disarm(context);
                }
                None => {}
            }
        }
    }

    /// One step of [`arm`](Self::arm): `None` if there are more.
    #[inline(always)]
    fn arm_step(
        &'static self,
        masked: &Masked,
        cursor: &mut Cursor,
        deadline: Ticks,
        target: Target,
    ) -> Option<Arming> {
        // Another task may have armed it meanwhile.
        if self.is_armed(masked) {
            return Some(Arming::Armed);
        }
        if !is_ahead(deadline.wrapping_sub(TICKS.get(masked))) {
            traversal::end(masked);
            return Some(Arming::Passed);
        }
        let slot = cursor.slot(masked);
        let next = slot.get(masked);
        if let Some(next) = next
            // Both deadlines are ahead, so their difference tells which is first.
            && !is_ahead(next.deadline.get(masked).wrapping_sub(deadline))
        {
            cursor.advance(next);
            return None;
        }
        traversal::end(masked);
        slot.set(masked, Some(self));
        // It may still lead to a timer on a stack that is gone.
        self.link.overwrite(masked, next);
        self.deadline.set(masked, deadline);
        self.target.set(masked, target);
        compare_with_first(masked);
        Some(Arming::Done)
    }

    /// Disarms the timer when its task is dropped.
    pub(crate) fn withdraw(&'static self) {
        // SAFETY: the run is over, or the task has panicked, which ends it: no task runs, and no interrupt
        // comes.
        self.cancel(&mut unsafe { Boot::assume() });
    }

    /// Takes the timer from the list. Returns whether it was there.
    fn disarm(&'static self, context: &mut impl ThreadContext) -> bool {
        disarm_first(context, |timer, _| ptr::eq(timer, self))
    }
}

/// How arming a timer ended.
enum Arming {
    Done,
    /// The deadline has passed.
    Passed,
    /// The timer is armed: it must be disarmed first.
    Armed,
}

/// The position of a traversal of the timers.
struct Cursor(Option<&'static Slot>);

impl Cursor {
    fn new() -> Self {
        Cursor(None)
    }

    /// The slot to look at: the next one, or the first of the list if the traversal restarts.
    #[inline(always)]
    fn slot(&self, masked: &Masked) -> &'static Slot {
        match self.0 {
            Some(slot) if traversal::is_valid(masked) => slot,
            _ => {
                traversal::begin(masked);
                &KERNEL.timers.first
            }
        }
    }

    #[inline(always)]
    fn advance(&mut self, next: &'static Timer) {
        self.0 = Some(&next.link);
    }
}

impl Task {
    /// Blocks for `ticks` ticks. As the present tick is under way, that is up to one tick shorter. With 0
    /// ticks it does not block.
    #[inline(always)]
    pub fn delay(&mut self, mut ticks: Ticks) {
        let mut begin = now(self);
        while ticks > LONGEST {
            begin = begin.wrapping_add(LONGEST);
            self.delay_until(begin);
            ticks -= LONGEST;
        }
        self.delay_until(begin.wrapping_add(ticks));
    }

    /// Blocks until the tick `deadline`, at most [`LONGEST`] ahead. Returns `false` at once if that has
    /// passed.
    #[inline(always)]
    pub fn delay_until(&mut self, deadline: Ticks) -> bool {
        let timer = Timer::new();
        // SAFETY: this returns only if the timer was not armed, or has expired. Killing the task disarms it.
        let timer: &'static Timer = unsafe { &*ptr::from_ref(&timer) };
        let _clean_up = arch::when_dropped(|| timer.withdraw());
        let is_ahead = timer.arm_for_task(self, deadline);
        if is_ahead && timer.block(self) {
            arch::switch(self);
        }
        is_ahead
    }
}

impl Timer {
    /// Blocks the running task, for which the timer was armed, unless the timer has expired already. Returns
    /// whether a switch is due.
    #[inline(never)]
    fn block(&self, task: &mut Task) -> bool {
        ready::block_unless(task, Link::DELAYED, |masked| !self.is_armed(masked))
    }
}

/// A period without drift: each deadline counts from the one before.
pub struct Period {
    deadline: Ticks,
    length: Ticks,
    missed: u16,
}

impl Period {
    /// A period of `length` ticks, 1 to [`LONGEST`], that starts now. A length beyond counts as the nearest
    /// of these.
    pub fn new(task: &mut Task, length: Ticks) -> Self {
        Period { deadline: now(task), length: length.clamp(1, LONGEST), missed: 0 }
    }

    /// Blocks until the next deadline. If that has passed already, it is counted as missed, and the call
    /// returns at once. A deadline that passed 65,536 ticks ago, less a period, or earlier can't be told from
    /// one that is to come.
    pub fn wait(&mut self, task: &mut Task) {
        self.deadline = self.deadline.wrapping_add(self.length);
        // A deadline is at most one period ahead. One that seems further ahead has passed by more than
        // `LONGEST`.
        let is_near = self.deadline.wrapping_sub(now(task)) <= self.length;
        if !(is_near && task.delay_until(self.deadline)) {
            self.missed = self.missed.saturating_add(1);
        }
    }

    /// How many deadlines had passed before the wait for them began.
    pub fn missed(&self) -> u16 {
        self.missed
    }
}

/// Whether a deadline `ticks` ticks from now lies in the future.
#[inline(always)]
fn is_ahead(ticks: Ticks) -> bool {
    (1..=LONGEST).contains(&ticks)
}

/// The tick in `ticks` ticks, at most [`LONGEST`].
#[inline(always)]
pub(crate) fn deadline_in(context: &mut impl Context, ticks: Ticks) -> Ticks {
    now(context).wrapping_add(ticks.min(LONGEST))
}

/// Makes the tick compare with the first timer's deadline. With no timer, the two match in 65,536 ticks.
#[inline(always)]
fn compare_with_first(masked: &Masked) {
    let first = KERNEL.timers.first.get(masked);
    NEXT_DEADLINE.set(masked, first.map_or(TICKS.get(masked), |first| first.deadline.get(masked)));
}

/// Counts a tick. Returns whether a deadline has come: [`expire`] must follow then.
///
/// On the AVR the vector of [`tick_interrupt!`](crate::tick_interrupt!) does this in assembly, in 40 cycles
/// where a handler takes 120; `tests/simavr/tests/tick.rs` checks it against this function.
///
/// # Safety
/// Only for the interrupt that drives the tick: otherwise time would run ahead of the deadlines that
/// [`expire`] must see.
#[doc(hidden)]
pub unsafe fn count_tick(masked: &Masked) -> bool {
    let now = TICKS.get(masked).wrapping_add(1);
    TICKS.set(masked, now);
    now == NEXT_DEADLINE.get(masked)
}

/// Expires all timers that are due. The tick's interrupt calls it when the first deadline has come.
///
/// Interrupts are enabled between the critical sections: no task runs meanwhile, and ISRs do not change
/// timers. Until this is complete, the deadline that the tick compares with lies in the past, so no tick
/// enters here as well.
///
/// # Safety
/// Only for the tick's interrupt, with interrupts masked: this makes a context of an interrupt.
///
/// ```compile_fail,E0133
/// # use kernel::Task;
/// fn body(_: &mut Task) {
///     kernel::expire(); // error: call to unsafe function requires an unsafe block
/// }
/// ```
#[doc(hidden)]
pub unsafe extern "C" fn expire() {
    // SAFETY: the caller guarantees that this is the tick's interrupt, with interrupts masked.
    let interrupt = &mut unsafe { Interrupt::assume() };
    // If none is armed, the deadline still matches, once in 65,536 ticks.
    while let Some(due) = interrupt.mask(expire_first) {
        // SAFETY: the tick's interrupt runs on the kernel's stack, and is between two critical sections.
        unsafe { arch::isr_window() };
        if !due.is_nothing() {
            interrupt.mask(|masked| due.end_wait(masked));
            // SAFETY: the tick's interrupt runs on the kernel's stack, and is between two critical sections.
            unsafe { arch::isr_window() };
        }
        if interrupt.mask(is_complete) {
            return;
        }
    }
    interrupt.mask(compare_with_first);
}

/// Removes the first timer from the list. If it ends a delay, wakes that task and returns
/// [`Target::NOTHING`]; otherwise returns the target that the caller must wake. `None` if there was no timer.
#[inline(always)]
fn expire_first(masked: &Masked) -> Option<Target> {
    let slot = &KERNEL.timers.first;
    let first = slot.get(masked)?;
    slot.set(masked, first.link.get(masked));
    traversal::end(masked);
    let target = first.target.replace(masked, Target::NOTHING);
    if target.is_task() {
        let task = target.as_task();
        if task.link.kind(masked) == Link::DELAYED.kind() {
            if !ready::preempt(masked, task) {
                ready::append(masked, task);
            }
            return Some(Target::NOTHING);
        }
    }
    Some(target)
}

/// Whether no other timer is due. If so, makes the tick compare with the next one's deadline.
#[inline(always)]
fn is_complete(masked: &Masked) -> bool {
    let now = TICKS.get(masked);
    let Some(first) = KERNEL.timers.first.get(masked) else {
        NEXT_DEADLINE.set(masked, now);
        return true;
    };
    let deadline = first.deadline.get(masked);
    let is_ahead = is_ahead(deadline.wrapping_sub(now));
    if is_ahead {
        NEXT_DEADLINE.set(masked, deadline);
    }
    is_ahead
}

/// Disarms the timers that are to wake `task`, which was killed.
pub(crate) fn disarm_all_of(context: &mut impl ThreadContext, task: &'static ControlBlock) {
    let is_its = |timer: &Timer, masked: &Masked| timer.target.get(masked).0 == Target::task(task).0;
    while disarm_first(context, is_its) {}
}

/// Disarms the first timer for which `is_it` holds. Returns whether there was one.
fn disarm_first(context: &mut impl ThreadContext, is_it: impl Fn(&Timer, &Masked) -> bool) -> bool {
    let mut cursor = Cursor::new();
    traversal::make(context, |masked| {
        let slot = cursor.slot(masked);
        let Some(timer) = slot.get(masked) else { return Some(false) };
        if !is_it(timer, masked) {
            cursor.advance(timer);
            return None;
        }
        slot.set(masked, timer.link.get(masked));
        timer.target.set(masked, Target::NOTHING);
        compare_with_first(masked);
        Some(true)
    })
}
