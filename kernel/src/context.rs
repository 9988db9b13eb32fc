//! The caller's context: a task or an interrupt.
//!
//! Kernel calls take the caller's context. A call that may block takes `&mut Task`, which only a task has:
//! from an interrupt it does not compile. A call that both may make takes `&mut impl Context`.
//!
//! ```compile_fail,E0308
//! # use kernel::{Interrupt, Semaphore};
//! fn handler(interrupt: &mut Interrupt, pressed: &Semaphore) {
//!     pressed.wait(interrupt); // error: expected `&mut Task`, found `&mut Interrupt`
//! }
//! ```
//!
//! A blocking call with interrupts masked does not compile either, since the critical section borrows the
//! task's context:
//!
//! ```compile_fail,E0500
//! # use kernel::{Context, Semaphore, Task};
//! fn body(task: &mut Task, pressed: &Semaphore) {
//!     task.mask(|_| pressed.wait(task)); // error: closure requires unique access to `*task`
//! }
//! ```
//!
//! The context also says, at compile time, whether interrupts are masked already, so that no call saves and
//! restores SREG: in a task a call is bracketed by `cli` and `sei` (2 cycles), in an interrupt by nothing.

use core::marker::PhantomData;

use crate::arch;
use crate::critical::Masked;

mod sealed {
    use super::Task;

    /// Other crates can't name this, and so can't call functions that take it.
    pub struct Private;

    pub trait Sealed {
        /// The calling task, if the caller is a task.
        #[inline(always)]
        fn task(&mut self, _: Private) -> Option<&mut Task> {
            None
        }
    }
}
pub(crate) use sealed::Private;

/// A caller of the kernel: [`Task`], [`Interrupt`], [`JobContext`], or [`Boot`] before there are any.
pub trait Context: sealed::Sealed {
    /// Runs `body` with interrupts masked. Keep it short: its length is interrupt latency. If two critical
    /// sections follow each other with no instruction between them, no interrupt occurs between them, unless
    /// there is a [window](Task::window): the latency is the sum of both.
    ///
    /// Each kernel call of a task, this one included, ends with interrupts enabled, whatever their state was
    /// before. So a task must make none inside of another crate's critical section: the call would end that
    /// section. The compiler does not notice; `stack-bound` refuses such a program.
    fn mask<R>(&mut self, body: impl FnOnce(&Masked) -> R) -> R;

    /// Runs the highest ready task if that is no longer the running one. In an interrupt this
    /// happens at its end, so there is nothing to do.
    #[doc(hidden)]
    fn reschedule(&mut self, is_needed: bool);

    /// Whether the caller is an ISR. A switch that its calls make due is made at its end.
    #[doc(hidden)]
    #[inline(always)]
    fn is_interrupt(&self) -> bool {
        false
    }
}

/// A caller outside of interrupts: [`Task`], [`JobContext`] or [`Boot`]. For calls whose time depends on the
/// length of a list.
pub trait ThreadContext: Context {}

impl ThreadContext for Task {}
impl ThreadContext for JobContext<'_> {}
impl ThreadContext for Boot {}

/// The context of a task: interrupts are enabled, blocking is allowed. Each task gets its own when it starts.
pub struct Task {
    _not_send: PhantomData<*mut ()>,
}

/// The context of a [`Job`](crate::Job): interrupts are enabled, but nothing may block.
///
/// ```compile_fail,E0308
/// # use kernel::{JobContext, Semaphore};
/// fn body(job: &mut JobContext, pressed: &Semaphore) {
///     pressed.wait(job); // error: expected `&mut Task`, found `&mut JobContext`
/// }
/// ```
pub struct JobContext<'a>(&'a mut Task);

impl<'a> JobContext<'a> {
    #[inline(always)]
    pub(crate) fn new(task: &'a mut Task) -> JobContext<'a> {
        JobContext(task)
    }
}

/// The context of an interrupt handler: interrupts are masked, nothing may block.
pub struct Interrupt {
    _not_send: PhantomData<*mut ()>,
}

impl Task {
    /// # Safety
    /// Only for the task that is about to run, with interrupts enabled, and once.
    pub(crate) unsafe fn assume() -> Task {
        Task { _not_send: PhantomData }
    }

    /// Lets pending interrupts occur between two critical sections with no other instruction between them. 1
    /// cycle if none is pending.
    #[inline(always)]
    pub fn window(&mut self) {
        arch::irq_window();
    }
}

impl Interrupt {
    /// # Safety
    /// Only in an interrupt handler that was entered by [`interrupt!`](crate::interrupt!), or before the
    /// kernel starts.
    #[doc(hidden)]
    #[inline(always)]
    pub unsafe fn assume() -> Interrupt {
        Interrupt { _not_send: PhantomData }
    }

    /// Lets pending interrupts occur between two critical sections of this interrupt; they nest on the
    /// kernel's stack. A long handler delays others no longer than from one window to the next. 3 cycles if
    /// none is pending.
    ///
    /// # Safety
    /// The interrupt of this handler must not occur again meanwhile, and no critical section may be open.
    #[inline(always)]
    pub unsafe fn window(&mut self) {
        // SAFETY: this is an ISR's context outside of a critical section, which would borrow it. The caller
        // guarantees that this interrupt does not occur again meanwhile, so each ISR is on the stack once.
        unsafe { arch::isr_window() };
    }
}

impl sealed::Sealed for Task {
    #[inline(always)]
    fn task(&mut self, _: Private) -> Option<&mut Task> {
        Some(self)
    }
}

impl sealed::Sealed for JobContext<'_> {
    #[inline(always)]
    fn task(&mut self, _: Private) -> Option<&mut Task> {
        Some(self.0)
    }
}

impl sealed::Sealed for Interrupt {}

impl sealed::Sealed for Boot {}

impl Context for Task {
    #[inline(always)]
    fn mask<R>(&mut self, body: impl FnOnce(&Masked) -> R) -> R {
        arch::disable_interrupts();
        // SAFETY: interrupts were just disabled. `body` can't enable them: that takes this `&mut Task`, which
        // is borrowed.
        let result = body(&unsafe { Masked::assume() });
        arch::enable_interrupts();
        result
    }

    #[inline(always)]
    fn reschedule(&mut self, is_needed: bool) {
        if is_needed {
            arch::switch_from_call(self);
        }
    }
}

impl Context for JobContext<'_> {
    #[inline(always)]
    fn mask<R>(&mut self, body: impl FnOnce(&Masked) -> R) -> R {
        self.0.mask(body)
    }

    #[inline(always)]
    fn reschedule(&mut self, is_needed: bool) {
        self.0.reschedule(is_needed);
    }
}

impl Context for Interrupt {
    #[inline(always)]
    fn mask<R>(&mut self, body: impl FnOnce(&Masked) -> R) -> R {
        // SAFETY: interrupts are masked on entry to a handler and stay so until it returns.
        body(&unsafe { Masked::assume() })
    }

    #[inline(always)]
    fn reschedule(&mut self, _is_needed: bool) {}

    #[inline(always)]
    fn is_interrupt(&self) -> bool {
        true
    }
}

impl Context for Boot {
    #[inline(always)]
    fn mask<R>(&mut self, body: impl FnOnce(&Masked) -> R) -> R {
        self.interrupt().mask(body)
    }

    /// The highest task runs when `Boot` is over.
    #[inline(always)]
    fn reschedule(&mut self, _is_needed: bool) {}
}

/// The context before the kernel runs: interrupts are masked, tasks are started.
pub struct Boot {
    interrupt: Interrupt,
}

impl Boot {
    /// # Safety
    /// Only while interrupts are masked and no task runs.
    pub(crate) unsafe fn assume() -> Boot {
        // SAFETY: interrupts are masked until the kernel runs, and it begins with a switch to the head.
        Boot { interrupt: unsafe { Interrupt::assume() } }
    }

    /// A context for calls that an interrupt might make, for setting up. It ends with the `Boot`:
    ///
    /// ```compile_fail,E0505
    /// # use kernel::{Boot, Interrupt};
    /// fn keep(mut boot: Boot) {
    ///     let context: &mut Interrupt = boot.interrupt();
    ///     drop(boot); // error: cannot move out of `boot` because it is borrowed
    ///     let _kept = context;
    /// }
    /// ```
    pub fn interrupt(&mut self) -> &mut Interrupt {
        &mut self.interrupt
    }
}

/// The return type of a task's body that never returns.
pub type Never = core::convert::Infallible;
