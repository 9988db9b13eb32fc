//! Tasks: priorities, control blocks, stacks.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::ptr;

use crate::arch;
use crate::context::{Context, Interrupt, Task};
use crate::handle::TaskHandle;
use crate::link::Link;
use crate::masked::{Masked, MaskedCell};
use crate::ready;

/// A task's priority: [`P0`](Priority::P0) is the highest of eight.
///
/// A task runs until it blocks or a task of higher priority becomes ready. Tasks of one priority take
/// turns in the order in which they became ready, and only when the running one blocks or yields.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
#[repr(u8)]
pub enum Priority {
    P0 = 0,
    P1 = 1,
    P2 = 2,
    P3 = 3,
    P4 = 4,
    P5 = 5,
    P6 = 6,
    P7 = 7,
}

impl Priority {
    pub(crate) const ALL: [Priority; 8] = {
        use Priority::*;
        [P0, P1, P2, P3, P4, P5, P6, P7]
    };

    /// The set of priorities above this one, a bit each: bit 0 is `P0`.
    pub(crate) const fn above(self) -> u8 {
        (1 << self as u8) - 1
    }
}

/// What the kernel keeps of a task: 6 bytes on the AVR, and 4 more with the feature `cpu-time`.
///
/// ```text
///              start                      highest ready
///   (unused) ─────────► ready (arrived) ──────────────► running
///                          ▲   yield ◄─────────────────── │ ▲
///                          │                     preempted ▼ │ the task above blocks
///                          │                     ready (preempted)
///                          └────── blocked ◄── wait ────── running
///                            post
/// ```
///
/// The running task and those it preempted form a list, highest first, in falling priority;
/// see [`ready`](crate::ready). A blocked task is in the list of what it waits for.
#[repr(C)]
pub struct ControlBlock {
    /// The set of priorities that preempt this task: all for the idle task.
    pub(crate) above: MaskedCell<u8>,
    /// The saved stack pointer; on the AVR bit 15 says that an interrupt saved the task, so that all
    /// registers lie there. On the host, a handle of the coroutine. 0 where there is no task, and [`STARTS`].
    pub(crate) stack_pointer: MaskedCell<usize>,
    /// What stands behind this task in the one list that it is in.
    pub(crate) link: MaskedCell<Link>,
    /// The priority in the low three bits, and the flags of [`Flag`]; unused for the idle task.
    pub(crate) priority: MaskedCell<u8>,
    /// How long it has had the CPU.
    #[cfg(feature = "cpu-time")]
    pub(crate) cpu_time: MaskedCell<u32>,
}

/// What keeps others from interfering with a task; and what is no task.
#[derive(Clone, Copy)]
#[repr(u8)]
pub(crate) enum Flag {
    /// It holds a mutex, or waits for one.
    Locks = 0x80,
    /// Others stand in for it in the lists of semaphores.
    Represented = 0x40,
    /// It stands in for a task: its `stack_pointer` is the address of a [`Group`](crate::group::Group).
    StandsIn = 0x20,
    /// It is being killed, or given another priority: it is suspended meanwhile, and only who does that ends it.
    Held = 0x10,
}

/// The priority in [`ControlBlock::priority`].
const PRIORITY: u8 = 7;

/// [`ControlBlock::stack_pointer`] of a task that is being started: its stack is taken, and it has no context yet.
const STARTS: usize = 1;

/// [`ControlBlock::above`] of a task that is suspended: nothing has less to preempt.
pub(crate) const SUSPENDED: u8 = 0xff;

impl ControlBlock {
    /// A block of a task that has not started.
    pub(crate) const fn new() -> Self {
        ControlBlock {
            above: MaskedCell::new(0),
            stack_pointer: MaskedCell::new(0),
            link: MaskedCell::new(Link::NONE),
            priority: MaskedCell::new(0),
            #[cfg(feature = "cpu-time")]
            cpu_time: MaskedCell::new(0),
        }
    }

    /// The block of the idle task, which every priority preempts.
    pub(crate) const fn idle() -> Self {
        ControlBlock {
            above: MaskedCell::new(0xff),
            stack_pointer: MaskedCell::new(arch::IDLE_CONTEXT),
            ..ControlBlock::new()
        }
    }

    /// The block of the scheduler, which nothing preempts.
    pub(crate) const fn scheduler() -> Self {
        ControlBlock { stack_pointer: MaskedCell::new(arch::SCHEDULER_CONTEXT), ..ControlBlock::new() }
    }

    /// The task behind this one among those that are ready: there always is one, the idle task or the ring's first.
    #[inline(always)]
    pub(crate) fn next_ready(&self, masked: &Masked) -> &'static ControlBlock {
        let next = self.link.get(masked).raw();
        debug_assert!(!next.is_null(), "the task is not ready");
        // SAFETY: whatever makes a task ready sets its link, to a static.
        unsafe { &*next }
    }

    /// Whether this task is of higher priority than `other`, where both wait.
    #[cfg(not(target_arch = "avr"))]
    pub(crate) fn precedes(&self, masked: &Masked, other: &ControlBlock) -> bool {
        self.priority.get(masked) & PRIORITY < other.priority.get(masked) & PRIORITY
    }

    /// The bit of this task's priority in a set of priorities.
    #[cfg(not(target_arch = "avr"))]
    pub(crate) fn bit(&self, masked: &Masked) -> u8 {
        self.above.get(masked).wrapping_add(1)
    }

    /// The index of this task's priority, 0 to 7.
    #[inline(always)]
    pub(crate) fn index(&self, masked: &Masked) -> usize {
        (self.priority.get(masked) & PRIORITY) as usize
    }

    pub(crate) fn priority(&self, masked: &Masked) -> Priority {
        use Priority::*;
        // Not from a table: that would lie in RAM.
        match self.index(masked) {
            0 => P0,
            1 => P1,
            2 => P2,
            3 => P3,
            4 => P4,
            5 => P5,
            6 => P6,
            _ => P7,
        }
    }

    /// The set of priorities above this task's, without the ceiling of a mutex.
    pub(crate) fn above_priority(&self, context: &mut impl Context) -> u8 {
        let priority = context.mask(|masked| self.priority.get(masked)) & PRIORITY;
        // Outside of the masked section: the AVR shifts by one bit at a time.
        arch::worked_out((1 << priority) - 1)
    }

    #[inline(always)]
    pub(crate) fn set_flag(&self, masked: &Masked, flag: Flag) {
        self.set_flags(masked, flag as u8);
    }

    /// Sets these [`Flag`]s.
    #[inline(always)]
    pub(crate) fn set_flags(&self, masked: &Masked, flags: u8) {
        self.priority.set(masked, self.priority.get(masked) | flags);
    }

    #[inline(always)]
    pub(crate) fn clear_flag(&self, masked: &Masked, flag: Flag) {
        self.priority.set(masked, self.priority.get(masked) & !(flag as u8));
    }

    #[inline(always)]
    pub(crate) fn has_flag(&self, masked: &Masked, flag: Flag) -> bool {
        self.has_any(masked, flag as u8)
    }

    /// Whether it has one of these [`Flag`]s.
    #[inline(always)]
    pub(crate) fn has_any(&self, masked: &Masked, flags: u8) -> bool {
        self.priority.get(masked) & flags != 0
    }

    /// Whether this task is suspended; whatever stands in for a task always is.
    #[inline(always)]
    pub(crate) fn is_suspended(&self, masked: &Masked) -> bool {
        self.above.get(masked) == SUSPENDED
    }

    /// Changes the priority, but not what preempts the task now.
    #[inline(always)]
    pub(crate) fn change_priority(&self, masked: &Masked, priority: Priority) {
        self.priority.set(masked, self.priority.get(masked) & !PRIORITY | priority as u8);
    }

    /// Takes the block for a task that is to start. Returns whether it was free.
    #[inline(never)]
    fn claim(&self, context: &mut impl Context) -> bool {
        context.mask(|masked| {
            let is_free = self.stack_pointer.get(masked) == 0;
            if is_free {
                self.stack_pointer.set(masked, STARTS);
            }
            is_free
        })
    }

    /// Makes the task ready, whose body is laid. Returns whether it is now the one to run.
    #[inline(never)]
    fn begin(&'static self, context: &mut impl Context, laid: arch::Laid, priority: Priority) -> bool {
        let stack_pointer = arch::lay_context(self, laid);
        // Outside of the masked section: the AVR shifts by one bit at a time.
        let above = arch::worked_out(priority.above());
        context.mask(|masked| {
            self.stack_pointer.set(masked, stack_pointer);
            self.above.set(masked, above);
            self.priority.set(masked, priority as u8);
            arch::make_ready(masked, self)
        })
    }

    /// Whether there is a task.
    #[inline(always)]
    pub(crate) fn is_started(&self, masked: &Masked) -> bool {
        self.stack_pointer.get(masked) > STARTS
    }

    /// The task has ended.
    pub(crate) fn forget(&self, masked: &Masked) {
        self.link.set(masked, Link::NONE);
        self.above.set(masked, 0);
        self.stack_pointer.set(masked, 0);
    }

    #[inline(always)]
    pub(crate) fn suspend(&self, masked: &Masked) {
        self.above.set(masked, SUSPENDED);
    }

    /// Whether both are the same task.
    #[inline(always)]
    pub(crate) fn is(&self, other: &ControlBlock) -> bool {
        ptr::eq(self, other)
    }
}

/// Why [`Stack::start`] refused.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum StartError {
    /// The task on this stack has been started before.
    Started,
    /// The stack can't hold what the task captured and its first context.
    TooSmall,
}

/// A task's control block and its stack of `BYTES` bytes.
///
/// ```
/// use kernel::Stack;
/// static BLINK: Stack<96> = Stack::new();
/// ```
///
/// A stack holds the task's own frames and, in the worst case, on top of them a voluntary context (4 bytes on the
/// ATmega128, 22 where a call switches that seldom does) and an interrupt's (35 bytes): handlers run on the kernel's stack.
#[repr(C)]
pub struct Stack<const BYTES: usize> {
    control: ControlBlock,
    memory: UnsafeCell<[MaybeUninit<u8>; BYTES]>,
}

// SAFETY: `memory` is touched by `start`, once and before the task runs, and then only as its stack.
unsafe impl<const BYTES: usize> Sync for Stack<BYTES> {}

impl<const BYTES: usize> Default for Stack<BYTES> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const BYTES: usize> Stack<BYTES> {
    /// A stack with no task on it.
    pub const fn new() -> Self {
        Stack { control: ControlBlock::new(), memory: UnsafeCell::new([MaybeUninit::uninit(); BYTES]) }
    }

    /// The task on this stack, to others.
    pub const fn task(&'static self) -> TaskHandle {
        TaskHandle { control: &self.control, bytes: BYTES }
    }

    /// Makes a task on this stack ready; it runs `body`, which never returns. What `body` captures moves onto the stack.
    ///
    /// Linear in the size of the stack, which is painted for [`TaskHandle::unused_stack`], with interrupts enabled: start no task
    /// from an interrupt that may not take so long.
    ///
    /// # Errors
    /// [`StartError::Started`] when the stack is taken, [`StartError::TooSmall`] when it can't hold
    /// what `body` captured and a first context. Nothing runs then.
    pub fn start<F>(
        &'static self,
        context: &mut impl Context,
        priority: Priority,
        body: F,
    ) -> Result<(), StartError>
    where
        F: FnOnce(&mut Task) -> Never + 'static,
    {
        if !arch::fits(size_of::<F>(), BYTES) {
            return Err(StartError::TooSmall);
        }
        if !self.control.claim(context) {
            return Err(StartError::Started);
        }
        // SAFETY: the block was free, and is claimed; and the stack is large enough.
        let laid = unsafe { arch::lay_body(self.memory.get(), body) };
        let is_due = self.control.begin(context, laid, priority);
        context.reschedule(is_due);
        Ok(())
    }
}

/// The address of the running task's [`Stack`], which names it to whoever has the program's symbols. In a handler,
/// that of the task which it interrupted; before any task ran, that of the kernel's idle task.
pub fn running(masked: &Masked) -> usize {
    ptr::from_ref(ready::running(masked)).addr()
}

/// What a task's body returns: nothing, ever.
pub type Never = core::convert::Infallible;

/// The time before the kernel runs: interrupts are masked, tasks are started.
pub struct Boot {
    pub(crate) masked: Masked,
}

impl Boot {
    /// # Safety
    /// Only while interrupts are masked and no task runs.
    pub(crate) unsafe fn assume() -> Boot {
        // SAFETY: the caller's promise.
        Boot { masked: unsafe { Masked::assume() } }
    }

    /// A context for calls that an interrupt might make, for setting up.
    pub fn interrupt(&mut self) -> Interrupt {
        // SAFETY: interrupts are masked until the kernel runs, and a switch is due then.
        unsafe { Interrupt::assume() }
    }
}

/// Starts the kernel: `init` sets up devices and starts tasks with interrupts masked; then the highest runs.
#[cfg(target_arch = "avr")]
pub fn run(init: impl FnOnce(&mut Boot)) -> ! {
    arch::disable_interrupts();
    // SAFETY: interrupts are masked until `arch::run` starts the first task; `boot` is gone by then.
    init(&mut unsafe { Boot::assume() });
    arch::run()
}
