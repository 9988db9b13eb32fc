//! Tasks: their stacks, their start and their end; and the start of the kernel.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::ptr;

use crate::arch;
use crate::context::{Boot, Context, Task};
use crate::control::{KillGuard, TaskHandle};
use crate::control_block::{ControlBlock, Priority};
use crate::critical::{Masked, MaskedCell};
use crate::ready;
use crate::{IDLE, KERNEL};

/// Why [`Stack::start`] refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartError {
    /// There is a task on this stack, or a killed one: see [`TaskHandle::reuse`].
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
/// A stack holds the task's own frames. In the worst case, a voluntary context (4 bytes on the ATmega128, 22
/// in a call that seldom switches) and an interrupt's context (35 bytes) lie on top of them. Handlers run on
/// the kernel's stack.
#[repr(C)]
pub struct Stack<const BYTES: usize> {
    control: ControlBlock,
    memory: UnsafeCell<[MaybeUninit<u8>; BYTES]>,
}

// SAFETY: `memory` is touched by `start`, once for a task and before that runs, and then only as its stack.
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

    /// A handle of the task on this stack, for other tasks.
    pub const fn task(&'static self) -> TaskHandle {
        TaskHandle { control: &self.control, bytes: BYTES }
    }

    /// Makes a task on this stack ready; it runs `body`. What `body` captures moves onto the stack. A body
    /// that returns ends its task, whatever it returns, and the stack can be started again. On the AVR a
    /// capture with an alignment above 1, by `repr(align)` or an atomic of 16 bits, does not compile.
    ///
    /// Linear in the size of the stack, each byte of which gets a watermark for [`TaskHandle::unused_stack`],
    /// with interrupts enabled in a task. Do not start a task from an interrupt that must not take that long.
    ///
    /// # Errors
    /// [`StartError::Started`] when the stack is taken, [`StartError::TooSmall`] when it can't hold
    /// what `body` captured and a first context. Nothing runs then.
    pub fn start<F, R>(
        &'static self,
        context: &mut impl Context,
        priority: Priority,
        body: F,
    ) -> Result<(), StartError>
    where
        F: FnOnce(&mut Task) -> R + Send + 'static,
    {
        if !arch::fits(size_of::<F>(), BYTES) {
            return Err(StartError::TooSmall);
        }
        let guard = KillGuard::begin(context);
        let is_free = context.mask(|masked| self.control.claim(masked));
        let is_due = is_free && {
            // SAFETY: the control block was free, and is claimed; and the stack is large enough.
            let stack_pointer = unsafe { arch::init_context(&self.control, self.memory.get(), body) };
            self.control.start(context, stack_pointer, priority)
        };
        guard.end(context);
        if !is_free {
            return Err(StartError::Started);
        }
        context.reschedule(is_due);
        Ok(())
    }
}

impl ControlBlock {
    /// Makes the task, whose first context lies on its stack, ready. Returns whether a switch is due.
    #[inline(never)]
    fn start(&'static self, context: &mut impl Context, stack_pointer: usize, priority: Priority) -> bool {
        context.mask(|masked| {
            self.stack_pointer.set(masked, stack_pointer);
            self.set_priority(masked, priority);
            ready::wake(masked, self)
        })
    }
}

/// The address of the running task's [`Stack`], by which a program's symbols tell its name. In a handler,
/// that of the task that was preempted; before any task ran, that of the kernel's idle task.
pub fn running(masked: &Masked) -> usize {
    ptr::from_ref(ready::running(masked)).addr()
}

/// Ends the running task, whose body has returned: nothing refers to its stack any more.
pub(crate) fn finish(task: &mut Task) -> ! {
    task.mask(|masked| {
        // In one critical section: with two, a task that is stepped or killed in between would not be free
        // for another.
        ready::leave(masked).free(masked);
        ready::update_head(masked);
        arch::run_head(masked)
    })
}

/// Whether [`run`] was called.
static RUNS: MaskedCell<bool> = MaskedCell::new(false);

/// Defines `main`, which starts the kernel: the closure sets up devices and starts tasks with interrupts
/// masked; then the highest runs.
///
/// ```ignore
/// kernel::main!(|boot| {
///     let started = BLINK.start(boot, Priority::P3, blink);
/// });
/// ```
///
/// The closure captures nothing. What its tasks need is a static, or moves into their bodies.
///
/// ```compile_fail,E0434
/// fn program(level: u8) {
///     kernel::main!(|_| drop(level)); // error: can't capture dynamic environment in a fn item
/// }
/// ```
#[macro_export]
macro_rules! main {
    ($init:expr) => {
        #[unsafe(no_mangle)]
        extern "C" fn main() -> ! {
            let init = $crate::init($init); // outside of the unsafe block
            // SAFETY: the start-up code is the first to call this, and nothing is on the stack that may be in
            // use. Another call replaces no stack.
            unsafe { $crate::run(init) }
        }
    };
}

/// Gives the closure of [`main!`](crate::main!) its type.
#[doc(hidden)]
#[inline(always)]
pub fn init<F: FnOnce(&mut Boot)>(init: F) -> F {
    init
}

/// Starts the kernel, as [`main!`](crate::main!) does.
///
/// A second call, by a task or an ISR, starts no second kernel: it never returns, leaves interrupts as they
/// are, and does not call `init`.
///
/// # Safety
/// The kernel's stack begins at the top of SRAM, and replaces that of `main` once `init` is over. So nothing
/// on the caller's stack may be in use any more, though it is never dropped: no pointer to a local of `main`,
/// no future that is pinned to one, nothing that one is lent to.
///
/// ```compile_fail,E0133
/// # use std::pin::pin;
/// # fn keep<T>(_: std::pin::Pin<&mut T>) {}
/// fn main() {
///     keep(pin!(0)); // it may be used until it is dropped
///     kernel::run(|_| {}); // error: call to unsafe function requires an unsafe block
/// }
/// ```
pub unsafe fn run(init: impl FnOnce(&mut Boot)) -> ! {
    if !arch::begin(&RUNS) {
        loop {
            core::hint::spin_loop();
        }
    }
    // SAFETY: interrupts are masked until `run_head` starts the first task, and no task runs as this is the
    // first call; `boot` is gone by then.
    let boot = &mut unsafe { Boot::assume() };
    init(boot);
    boot.mask(|masked| {
        debug_assert!(KERNEL.ready.running.get(masked).is(&IDLE));
        arch::run_head(masked)
    })
}
