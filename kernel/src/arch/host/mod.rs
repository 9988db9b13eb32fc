//! The host port: the same kernel, each task a coroutine, time virtual.
//!
//! Blocking code runs under `cargo test` as it does on the MCU, and the same each time: a task runs until
//! a kernel call switches, and when all are blocked, time moves on to the next tick. Interrupts are what
//! the test makes of them: [`run_for`] calls its `on_tick` at every tick, which may post, send and put, and a
//! task may be preempted by an [`interrupt`] between two of its calls, or [inside](interrupted) of one.

extern crate std;

use std::any::Any;
use std::boxed::Box;
use std::cell::{Cell, RefCell};
use std::io::{self, Write as _};
use std::mem::MaybeUninit;
use std::ops::Range;
use std::panic::{self, AssertUnwindSafe};
use std::process;
use std::ptr;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::vec::Vec;

use corosensei::{Coroutine, Yielder};

use crate::context::{Boot, Context, Interrupt, Never, Task};
use crate::control_block::{ControlBlock, Flag, Priority};
use crate::critical::Masked;
use crate::{IDLE, KERNEL, ready, task, timer, wait};

type TaskCoroutine = Coroutine<(), (), Never>;

pub(crate) const IDLE_CONTEXT: usize = 0;

/// The highest byte of an address is 0.
pub(crate) const LINK_MARK: usize = 1 << (usize::BITS - 8);

/// The `stack_pointer` of the first task: less says that there is none, or that it is being started.
const FIRST_TASK: usize = 2;

std::thread_local! {
    /// The tasks of this run. A control block's `stack_pointer` is the index of its own, plus [`FIRST_TASK`].
    static TASKS: RefCell<Vec<HostTask>> = const { RefCell::new(Vec::new()) };
    /// The interrupt that is to occur inside of a kernel call.
    static ARRIVAL: RefCell<Option<Arrival>> = const { RefCell::new(None) };
    /// How the running task gives control back; null while none runs.
    static YIELDER: Cell<*const Yielder<(), ()>> = const { Cell::new(ptr::null()) };
    /// Whether the running task has not switched where it was due, as it was failing.
    static OWES_SWITCH: Cell<bool> = const { Cell::new(false) };
    /// The panic of an interrupt inside of a kernel call, which ends the run.
    static FAILURE: RefCell<Option<Box<dyn Any + Send>>> = const { RefCell::new(None) };
    /// Whether this thread has the [`OneKernel`].
    static HAS_KERNEL: Cell<bool> = const { Cell::new(false) };
}

struct HostTask {
    control: &'static ControlBlock,
    /// Taken out while it runs.
    coroutine: Option<TaskCoroutine>,
}

struct Arrival {
    /// How many critical sections end until then, this one included.
    sections: usize,
    handler: Box<dyn FnOnce(&mut Interrupt)>,
}

/// The right to the kernel: its state is static, and tests run on many threads.
struct OneKernel {
    _lock: MutexGuard<'static, ()>,
}

impl OneKernel {
    /// Waits until no other thread has it.
    fn take() -> Self {
        static LOCK: Mutex<()> = Mutex::new(());
        let lock = LOCK.lock().unwrap_or_else(PoisonError::into_inner);
        HAS_KERNEL.set(true);
        OneKernel { _lock: lock }
    }
}

impl Drop for OneKernel {
    fn drop(&mut self) {
        HAS_KERNEL.set(false);
    }
}

/// What runs as the tasks of a run that is over are dropped: it may do all but block.
static UNDERTAKER: ControlBlock = ControlBlock::new();

/// Runs the kernel for `ticks` ticks: `init` starts the tasks, `on_tick` stands for the interrupts.
///
/// At the end the tasks are killed and dropped: their stacks are free, they wait for nothing any more, and no
/// timer is armed. The statics they used keep their state otherwise. What they drop then may make kernel
/// calls, but none that blocks: that ends the program. So does a task that goes on to block, or returns, as
/// it has caught the panic by which it is dropped: [`resume_unwind`](panic::resume_unwind) passes that on.
pub fn run_for(ticks: u32, init: impl FnOnce(&mut Boot), mut on_tick: impl FnMut(&mut Interrupt, u32)) {
    let mut passed = 0;
    run(init, |interrupt| {
        if passed == ticks {
            return false;
        }
        passed += 1;
        tick(interrupt);
        on_tick(interrupt, passed);
        true
    });
}

/// Runs the kernel: `init` starts the tasks, and whenever all of them are blocked, `on_idle` stands for the
/// interrupt that comes then, until it returns `false`. Time stands still unless it calls [`tick`].
///
/// A task that panics ends the run, and the caller gets the panic. So does an interrupt; where it comes
/// [inside](interrupted) of a call its task can't catch that.
pub fn run(init: impl FnOnce(&mut Boot), mut on_idle: impl FnMut(&mut Interrupt) -> bool) {
    assert!(!HAS_KERNEL.get(), "this thread runs a kernel already");
    let _kernel = OneKernel::take();
    end_run(); // one whose end has failed
    let outcome = panic::catch_unwind(AssertUnwindSafe(|| {
        // SAFETY: no task runs.
        init(&mut unsafe { Boot::assume() });
        loop {
            run_ready();
            // SAFETY: no task runs, as in an interrupt.
            if !on_idle(&mut unsafe { Interrupt::assume() }) {
                return;
            }
        }
    }));
    // Now, while no other kernel can run: the tasks are dropped, and what they hold goes back.
    end_run();
    if let Err(panic) = outcome {
        panic::resume_unwind(panic);
    }
}

/// One tick of the clock, for an interrupt to call.
pub fn tick(interrupt: &mut Interrupt) {
    // SAFETY: this is the tick's interrupt.
    if interrupt.mask(|masked| unsafe { timer::count_tick(masked) }) {
        // SAFETY: this is the tick's interrupt.
        unsafe { timer::expire() };
    }
}

/// An interrupt in the midst of a task: runs `handler`, then a task that became ready by it and outranks this
/// one.
pub fn interrupt(handler: impl FnOnce(&mut Interrupt)) {
    assert!(HAS_KERNEL.get(), "no kernel runs on this thread");
    // SAFETY: the calling task does nothing else meanwhile, as on the MCU.
    handler(&mut unsafe { Interrupt::assume() });
    if critical(ready::is_due) {
        suspend();
    }
}

/// Makes a kernel call of a task, or a [`tick`], that an interrupt preempts at the end of its `sections`-th
/// critical section, counted from 1, while that task runs. If there are fewer, the interrupt does not come.
pub fn interrupted<R>(
    sections: usize,
    handler: impl FnOnce(&mut Interrupt) + 'static,
    call: impl FnOnce() -> R,
) -> R {
    arrive_later(sections, handler);
    let result = call();
    cancel_arrival();
    result
}

/// From inside of [`interrupted`], where a job begins: if the interrupt has not come, it does not come.
pub fn cancel_arrival() {
    ARRIVAL.set(None);
}

/// From the handler of [`interrupted`], or at the end of a job: another interrupt occurs so many critical
/// sections later.
pub fn arrive_later(sections: usize, handler: impl FnOnce(&mut Interrupt) + 'static) {
    ARRIVAL.set(Some(Arrival { sections, handler: Box::new(handler) }));
}

/// Kills the tasks of this run, drops them, and leaves the kernel as at the start. What is dropped may start
/// others.
fn end_run() {
    YIELDER.set(ptr::null()); // a task that has failed leaves its own
    OWES_SWITCH.set(false);
    FAILURE.take();
    ARRIVAL.take();
    while TASKS.with_borrow(|tasks| !tasks.is_empty()) {
        // SAFETY: no task runs.
        let boot = &mut unsafe { Boot::assume() };
        boot.mask(|masked| KERNEL.ready.reset(masked));
        let controls = TASKS.with_borrow(|tasks| tasks.iter().map(|task| task.control).collect::<Vec<_>>());
        // As long as all have their stacks, which may hold what others wait for.
        for control in &controls {
            boot.mask(|masked| {
                control.set_flag(masked, Flag::Killed);
                control.halt(masked);
            });
            wait::withdraw(boot, control);
        }
        for task in TASKS.take() {
            boot.mask(|masked| {
                KERNEL.ready.reset(masked);
                UNDERTAKER.set_priority(masked, Priority::P0);
                ready::wake(masked, &UNDERTAKER);
                KERNEL.ready.running.set(masked, &UNDERTAKER);
            });
            drop(task);
        }
        controls.iter().for_each(|control| boot.mask(|masked| control.free(masked)));
    }
    // SAFETY: no task runs.
    let masked = unsafe { Masked::assume() };
    KERNEL.ready.reset(&masked);
    KERNEL.timers.reset(&masked);
}

/// Resumes the head until that is the idle task.
fn run_ready() {
    loop {
        // SAFETY: no task runs.
        let masked = unsafe { Masked::assume() };
        let head = KERNEL.ready.head.get(&masked);
        KERNEL.ready.running.set(&masked, head);
        if head.is(&IDLE) {
            return;
        }
        let index = head.stack_pointer.get(&masked) - FIRST_TASK;
        // Taken out while it runs, so that it may start others.
        let coroutine = TASKS.with_borrow_mut(|tasks| tasks[index].coroutine.take());
        let mut coroutine = coroutine.expect("a task is resumed once at a time");
        coroutine.resume(());
        YIELDER.set(ptr::null());
        TASKS.with_borrow_mut(|tasks| tasks[index].coroutine = Some(coroutine));
        if let Some(panic) = FAILURE.take() {
            panic::resume_unwind(panic);
        }
    }
}

/// Where a task has caught what failed, the switch that it owes comes first.
pub(crate) fn disable_interrupts() {
    if !thread::panicking() && OWES_SWITCH.take() {
        suspend();
    }
}

pub(crate) fn enable_interrupts() {
    if let Some(Arrival { handler, .. }) = end_section() {
        interrupt(|interrupt| {
            // The task must not go on in the midst of a call, and might catch the panic.
            if let Err(panic) = panic::catch_unwind(AssertUnwindSafe(|| handler(interrupt))) {
                FAILURE.set(Some(panic));
                suspend();
            }
        });
    }
}

pub(crate) fn irq_window() {}

/// # Safety
/// As on the AVR: only in an ISR, between two of its critical sections.
pub(crate) unsafe fn isr_window() {
    if let Some(Arrival { handler, .. }) = end_section() {
        // SAFETY: the tick's interrupt, which calls this, does nothing else meanwhile, and switches at its
        // end.
        handler(&mut unsafe { Interrupt::assume() });
    }
}

/// A critical section ends. Returns the interrupt that occurs now.
fn end_section() -> Option<Arrival> {
    ARRIVAL.with_borrow_mut(|arrival| {
        let sections = &mut arrival.as_mut()?.sections;
        *sections = sections.saturating_sub(1);
        if *sections == 0 { arrival.take() } else { None }
    })
}

pub(crate) fn critical<R>(body: impl FnOnce(&Masked) -> R) -> R {
    // A message may be dropped on any thread.
    let _kernel = (!HAS_KERNEL.get()).then(OneKernel::take);
    // SAFETY: what stands for interrupts runs only between critical sections.
    body(&unsafe { Masked::assume() })
}

pub(crate) fn switch(_: &mut Task) {
    suspend();
}

pub(crate) fn switch_from_call(_: &mut Task) {
    suspend();
}

/// A task that is dropped, or that failed, has nobody to go on with it.
pub(crate) fn may_block() {
    let message = "a task that is dropped blocks";
    assert!(!thread::panicking(), "{message}");
    // Who has caught the panic by which it is dropped would catch another, too.
    if critical(ready::running).is(&UNDERTAKER) {
        let _ = writeln!(io::stderr(), "{message}"); // which no test captures
        process::abort();
    }
}

pub(crate) fn begin() {
    panic!("on the host `host::run` runs the kernel");
}

/// Gives control back to [`run_ready`], until that resumes the task.
fn suspend() {
    // A task that is dropped, or that failed, gives back what it holds and runs no other.
    if thread::panicking() {
        OWES_SWITCH.set(true);
        return;
    }
    // An arrival interrupts this task only.
    let arrival = ARRIVAL.take();
    let yielder = YIELDER.get();
    assert!(!yielder.is_null(), "a kernel call that may switch was made outside `host::run_for`");
    // SAFETY: the pointer is the running coroutine's own yielder, which lives as long as it does.
    unsafe { (*yielder).suspend(()) };
    YIELDER.set(yielder);
    ARRIVAL.set(arrival);
}

pub(crate) fn run_head(_: &Masked) -> ! {
    loop {
        suspend();
    }
}

/// Does `clean_up` if the task is dropped while the result lives: at the end of a run, or as it panics.
pub(crate) fn when_dropped(clean_up: impl FnMut()) -> impl Drop {
    struct WhenDropped<F: FnMut()>(F);

    impl<F: FnMut()> Drop for WhenDropped<F> {
        fn drop(&mut self) {
            if thread::panicking() {
                (self.0)();
            }
        }
    }

    WhenDropped(clean_up)
}

/// The clock of tasks' times: none passes while a task runs.
#[cfg(feature = "cpu-time")]
pub(crate) fn clock(_: &Masked) -> u16 {
    0
}

/// The coroutine has a stack of its own.
pub(crate) fn stack(_: &'static ControlBlock, _: usize) -> Option<Range<usize>> {
    None
}

/// The tests tick.
pub(crate) fn need_tick() {}

/// Any stack will do: the task gets one of its own.
pub(crate) const fn fits(_body: usize, _bytes: usize) -> bool {
    true
}

/// # Safety
/// As on the AVR.
pub(crate) unsafe fn init_context<F, R, const BYTES: usize>(
    control: &'static ControlBlock,
    _: *mut [MaybeUninit<u8>; BYTES],
    body: F,
) -> usize
where
    F: FnOnce(&mut Task) -> R + Send + 'static,
{
    let coroutine = Coroutine::new(move |yielder: &Yielder<(), ()>, ()| {
        YIELDER.set(yielder);
        // SAFETY: this is the task, and it has just started.
        let task = &mut unsafe { Task::assume() };
        body(task);
        task::finish(task)
    });
    TASKS.with_borrow_mut(|tasks| {
        tasks.push(HostTask { control, coroutine: Some(coroutine) });
        tasks.len() - 1 + FIRST_TASK
    })
}

/// A copy of element `index` of a table.
pub(crate) fn load<T: Copy>(table: &[T], index: usize) -> Option<T> {
    table.get(index).copied()
}

/// A static of [`flash!`](crate::flash!).
#[doc(hidden)]
#[macro_export]
macro_rules! flash_static {
    ($($item:tt)*) => { $($item)* };
}
