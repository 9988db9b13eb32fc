//! The host port: the same kernel, with tasks as coroutines and virtual time.
//!
//! Blocking code runs under `cargo test` as it does on the MCU, and deterministically: a task runs until a
//! kernel call switches, and when all tasks are blocked, time advances to the next tick. The test supplies
//! the interrupts: [`run_for`] calls its `on_tick` at every tick, which may post, send and put. An
//! [interrupt] may also preempt a task between two of its calls, or [inside](interrupted) of one.

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
use crate::critical::{Masked, MaskedCell};
use crate::{IDLE, KERNEL, ready, task, timer, wait};

type TaskCoroutine = Coroutine<(), (), Never>;

pub(crate) const IDLE_CONTEXT: usize = 0;

/// The highest byte of an address is 0, if it has 64 bits.
pub(crate) const LINK_MARK: usize = 1 << (usize::BITS - 8);

const _: () = assert!(usize::BITS == 64, "the kernel's host port needs addresses of 64 bits");

/// The `stack_pointer` of the first task. Lower values mean that there is no task, or that it is being
/// started.
const FIRST_TASK: usize = 2;

std::thread_local! {
    /// The tasks of this run. A control block's `stack_pointer` is the index of its own, plus [`FIRST_TASK`].
    static TASKS: RefCell<Vec<HostTask>> = const { RefCell::new(Vec::new()) };
    /// The interrupt that is to occur inside of a kernel call.
    static ARRIVAL: RefCell<Option<Arrival>> = const { RefCell::new(None) };
    /// The running task's way to return control to [`run_ready`]; null while no task runs.
    static YIELDER: Cell<*const Yielder<(), ()>> = const { Cell::new(ptr::null()) };
    /// Whether the running task has put off a switch that was due, because it was panicking.
    static OWES_SWITCH: Cell<bool> = const { Cell::new(false) };
    /// The panic of an interrupt inside of a kernel call; it ends the run.
    static FAILURE: RefCell<Option<Box<dyn Any + Send>>> = const { RefCell::new(None) };
    /// Whether this thread has the [`OneKernel`].
    static HAS_KERNEL: Cell<bool> = const { Cell::new(false) };
}

struct HostTask {
    control: &'static ControlBlock,
    /// `None` while the task runs, and when its body has returned.
    coroutine: Option<TaskCoroutine>,
}

struct Arrival {
    /// The interrupt occurs when so many critical sections have ended, the present one included.
    sections: usize,
    handler: Box<dyn FnOnce(&mut Interrupt)>,
}

/// The exclusive right to the kernel, whose state is static, while tests run on many threads.
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

/// The running task while the tasks of a finished run are dropped. It may make any kernel call that does not
/// block.
static UNDERTAKER: ControlBlock = ControlBlock::new();

/// Runs the kernel for `ticks` ticks: `init` starts the tasks, `on_tick` stands for the interrupts.
///
/// At the end the tasks are killed and dropped: their stacks are free, they wait for nothing any more, and no
/// timer is armed. The statics they used keep their state otherwise. Values that are dropped then may make
/// kernel calls, but one that blocks ends the program. A task that catches the panic by which it is dropped
/// must pass it on with [`resume_unwind`](panic::resume_unwind): if it blocks or returns instead, that ends
/// the program, too.
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

/// Runs the kernel: `init` starts the tasks. Whenever all of them are blocked, `on_idle` stands for the next
/// interrupt; the run ends when it returns `false`. Time advances only when it calls [`tick`].
///
/// A panic of a task or of an interrupt ends the run and is passed to the caller. If the interrupt occurs
/// [inside](interrupted) of a call, the task that makes the call can't catch the panic.
pub fn run(init: impl FnOnce(&mut Boot), mut on_idle: impl FnMut(&mut Interrupt) -> bool) {
    assert!(!HAS_KERNEL.get(), "this thread runs a kernel already");
    let _kernel = OneKernel::take();
    end_run(); // of an earlier run whose end has failed
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
    // Now, while no other kernel can run: dropping the tasks returns what they hold, by kernel calls.
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

/// Interrupts the calling task: runs `handler`, then each task that became ready by it and outranks the
/// caller.
pub fn interrupt(handler: impl FnOnce(&mut Interrupt)) {
    assert!(HAS_KERNEL.get(), "no kernel runs on this thread");
    // SAFETY: the calling task does nothing else meanwhile, as on the MCU.
    handler(&mut unsafe { Interrupt::assume() });
    if critical(ready::is_due) {
        suspend();
    }
}

/// Makes a kernel call of a task, or a [`tick`], and lets an interrupt occur at the end of its `sections`-th
/// critical section, counted from 1, while that task runs. If the call has fewer, the interrupt does not
/// occur.
pub fn interrupted<R>(
    sections: usize,
    handler: impl FnOnce(&mut Interrupt) + 'static,
    call: impl FnOnce() -> R,
) -> R {
    /// Also where the call panics, and its task catches that.
    struct Cancels;

    impl Drop for Cancels {
        fn drop(&mut self) {
            cancel_arrival();
        }
    }

    let _cancels = Cancels;
    arrive_later(sections, handler);
    call()
}

/// Cancels the interrupt of [`interrupted`], if it has not occurred yet: for the beginning of a job.
pub fn cancel_arrival() {
    ARRIVAL.set(None);
}

/// Lets another interrupt occur after `sections` more critical sections: for the handler of [`interrupted`],
/// or the end of a job.
pub fn arrive_later(sections: usize, handler: impl FnOnce(&mut Interrupt) + 'static) {
    ARRIVAL.set(Some(Arrival { sections, handler: Box::new(handler) }));
}

/// Kills the tasks of this run, drops them, and resets the kernel to its initial state. Values that are
/// dropped may start further tasks, so this repeats until none is left.
fn end_run() {
    YIELDER.set(ptr::null()); // a task that has panicked leaves its own
    OWES_SWITCH.set(false);
    FAILURE.take();
    ARRIVAL.take();
    while TASKS.with_borrow(|tasks| !tasks.is_empty()) {
        // SAFETY: no task runs.
        let boot = &mut unsafe { Boot::assume() };
        boot.mask(|masked| KERNEL.ready.reset(masked));
        let controls = TASKS.with_borrow(|tasks| tasks.iter().map(|task| task.control).collect::<Vec<_>>());
        // Before any is dropped: their stacks may hold objects that others wait for.
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
        // Where the body has returned, the coroutine is not needed any more, and a run may start very many.
        if head.is_started(&masked) {
            TASKS.with_borrow_mut(|tasks| tasks[index].coroutine = Some(coroutine));
        }
        if let Some(panic) = FAILURE.take() {
            panic::resume_unwind(panic);
        }
    }
}

/// If a task has caught its panic, it first makes the switch that it has put off meanwhile.
pub(crate) fn disable_interrupts() {
    if !thread::panicking() && OWES_SWITCH.take() {
        suspend();
    }
}

pub(crate) fn enable_interrupts() {
    if let Some(Arrival { handler, .. }) = end_section() {
        interrupt(|interrupt| {
            // The task might catch the panic, but must not continue in the middle of a call: it is suspended.
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
        // SAFETY: the tick's interrupt calls this. It does nothing else meanwhile, and switches at its end.
        handler(&mut unsafe { Interrupt::assume() });
    }
}

/// Counts the end of a critical section. Returns the interrupt that occurs now, if any.
fn end_section() -> Option<Arrival> {
    ARRIVAL.with_borrow_mut(|arrival| {
        let sections = &mut arrival.as_mut()?.sections;
        *sections = sections.saturating_sub(1);
        if *sections == 0 { arrival.take() } else { None }
    })
}

pub(crate) fn critical<R>(body: impl FnOnce(&Masked) -> R) -> R {
    // A message may be dropped on a thread without a kernel, too.
    let _kernel = (!HAS_KERNEL.get()).then(OneKernel::take);
    // SAFETY: simulated interrupts run only between critical sections.
    body(&unsafe { Masked::assume() })
}

pub(crate) fn switch(_: &mut Task) {
    suspend();
}

pub(crate) fn switch_from_call(_: &mut Task) {
    suspend();
}

/// Fails in a task that is being dropped or has panicked: nothing would resume it.
pub(crate) fn may_block() {
    let message = "a task that is dropped blocks";
    assert!(!thread::panicking(), "{message}");
    // A task that has caught the panic by which it is dropped would catch another, too.
    if critical(ready::running).is(&UNDERTAKER) {
        let _ = writeln!(io::stderr(), "{message}"); // not captured by tests
        process::abort();
    }
}

pub(crate) fn begin(_: &MaskedCell<bool>) -> bool {
    panic!("on the host `host::run` runs the kernel");
}

/// Gives control back to [`run_ready`], until that resumes the task.
fn suspend() {
    // A task that is being dropped or has panicked only releases what it holds: it does not run others.
    if thread::panicking() {
        OWES_SWITCH.set(true);
        return;
    }
    // The pending arrival interrupts this task only.
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

/// The clock of tasks' CPU times: no time passes while a task runs.
#[cfg(feature = "cpu-time")]
pub(crate) fn clock(_: &Masked) -> u16 {
    0
}

/// The coroutine has a stack of its own.
pub(crate) fn stack(_: &'static ControlBlock, _: usize) -> Option<Range<usize>> {
    None
}

/// The test drives the tick.
pub(crate) fn need_tick() {}

/// Any size will do: the coroutine has a stack of its own.
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
    (unsafe $($item:tt)*) => { $($item)* };
}
