//! The host port: the same kernel, each task a coroutine, time virtual.
//!
//! Blocking code runs under `cargo test` as it does on the MCU, and the same each time: a task runs until
//! a kernel call switches, and when all are blocked, time moves on to the next tick. Interrupts are what
//! the test makes of them: [`run_for`] calls its `on_tick` at every tick, which may post, send and put, and a
//! task may be struck by an [`interrupt`] between two of its calls, or [inside](struck) of one.

use std::boxed::Box;
use std::cell::{Cell, RefCell};
use std::mem::MaybeUninit;
use std::ops::Range;
use std::panic::{self, AssertUnwindSafe};
use std::ptr;
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::vec::Vec;

use corosensei::stack::{DefaultStack, Stack as _};
use corosensei::{Coroutine, Yielder};

use crate::context::{Context, Interrupt, Task, ThreadContext};
use crate::group::Group;
use crate::link::Link;
use crate::list::{self, Found, Suspension};
use crate::masked::Masked;
use crate::pool::{Pooled, Slot};
use crate::queue::{Appended, Queue};
use crate::semaphore::{Came, Semaphore, Until};
use crate::target::Target;
use crate::task::{Boot, ControlBlock, Flag, Never, Priority};
use crate::timer::{Ticks, Timer};
use crate::word::State;
use crate::{IDLE, KERNEL, SCHEDULER, ready, timer};

type TaskCoroutine = Coroutine<(), (), Never>;

/// What is no task has no context here.
pub(crate) const IDLE_CONTEXT: usize = 0;
pub(crate) const SCHEDULER_CONTEXT: usize = 0;

/// The `stack_pointer` of the first task: less says that there is none, or that it is being started.
const FIRST_TASK: usize = 2;

std::thread_local! {
    /// The coroutines of this run. A control block's `stack_pointer` is the index of its own, plus [`FIRST_TASK`].
    static TASKS: RefCell<Vec<Option<TaskCoroutine>>> = const { RefCell::new(Vec::new()) };
    /// The interrupt that is to strike inside of a kernel call.
    static STRIKE: RefCell<Option<Strike>> = const { RefCell::new(None) };
    /// Where their stacks lie.
    static STACKS: RefCell<Vec<Range<usize>>> = const { RefCell::new(Vec::new()) };
    /// How the running task gives control back.
    static YIELDER: Cell<*const Yielder<(), ()>> = const { Cell::new(std::ptr::null()) };
}

struct Strike {
    /// How many masked sections end until then, this one included.
    sections: usize,
    handler: Box<dyn FnOnce(&mut Interrupt)>,
}

/// One kernel at a time: its state is static, and tests run on many threads.
static ONE_KERNEL: Mutex<()> = Mutex::new(());

/// Runs the kernel for `ticks` ticks: `init` starts the tasks, `on_tick` stands for the interrupts.
///
/// The tasks are dropped at the end; the statics they used keep their state, so each run wants its own.
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

/// Runs the kernel: `init` starts the tasks, and whenever all of them are blocked, `on_idle` stands for the interrupt that
/// comes then, until it returns `false`. Time stands still unless it calls [`tick`].
///
/// A task that panics ends the run, and the caller gets the panic.
pub fn run(init: impl FnOnce(&mut Boot), mut on_idle: impl FnMut(&mut Interrupt) -> bool) {
    let _one_kernel = ONE_KERNEL.lock().unwrap_or_else(PoisonError::into_inner);
    reset();
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
    reset();
    if let Err(panic) = outcome {
        panic::resume_unwind(panic);
    }
}

/// One tick of the clock, for an interrupt to call.
pub fn tick(interrupt: &mut Interrupt) {
    timer::tick(interrupt);
}

/// An interrupt in the midst of a task: runs `handler`, then a task that became ready by it and outranks this one.
pub fn interrupt(handler: impl FnOnce(&mut Interrupt)) {
    // SAFETY: the calling task does nothing else meanwhile, as on the MCU.
    handler(&mut unsafe { Interrupt::assume() });
    if mask_anywhere(ready::is_due) {
        switch_from_call();
    }
}

/// Makes a kernel call of a task, or a [`tick`], that an interrupt strikes at the end of its `sections`-th masked section,
/// counted from 1, while that task runs. If there are fewer, the interrupt does not come.
pub fn struck<R>(
    sections: usize,
    handler: impl FnOnce(&mut Interrupt) + 'static,
    call: impl FnOnce() -> R,
) -> R {
    strike_again(sections, handler);
    let result = call();
    strike_no_more();
    result
}

/// From inside of [`struck`], where a job begins: if the interrupt has not come, it does not come.
pub fn strike_no_more() {
    STRIKE.set(None);
}

/// From the handler of [`struck`], or at the end of a job: another interrupt strikes so many masked sections later.
pub fn strike_again(sections: usize, handler: impl FnOnce(&mut Interrupt) + 'static) {
    STRIKE.set(Some(Strike { sections, handler: Box::new(handler) }));
}

/// Forgets the tasks of the run before.
fn reset() {
    TASKS.take();
    STACKS.take();
    // SAFETY: no task runs, and no other thread: the caller holds `ONE_KERNEL`.
    let masked = unsafe { Masked::assume() };
    KERNEL.ready.reset(&masked, &IDLE);
    KERNEL.timers.reset(&masked);
}

/// Resumes the head until that is the idle task.
fn run_ready() {
    loop {
        // SAFETY: no task runs.
        let masked = unsafe { Masked::assume() };
        let head = KERNEL.ready.head.get(&masked);
        if head.is(&SCHEDULER) {
            ready::schedule(&masked);
            continue;
        }
        KERNEL.ready.running.set(&masked, head);
        if head.is(&IDLE) {
            return;
        }
        let index = head.stack_pointer.get(&masked) - FIRST_TASK;
        // Taken out while it runs, so that it may start others.
        let mut task =
            TASKS.with_borrow_mut(|tasks| tasks[index].take().expect("a task is resumed once at a time"));
        task.resume(());
        TASKS.with_borrow_mut(|tasks| tasks[index] = Some(task));
    }
}

pub(crate) fn disable_interrupts() {}

pub(crate) fn enable_interrupts() {
    if let Some(Strike { handler, .. }) = end_section() {
        interrupt(handler);
    }
}

pub(crate) fn let_interrupts_strike() {
    if let Some(Strike { handler, .. }) = end_section() {
        // SAFETY: the tick's interrupt, which calls this, does nothing else meanwhile, and switches at its end.
        handler(&mut unsafe { Interrupt::assume() });
    }
}

/// A masked section ends. Returns what strikes now.
fn end_section() -> Option<Strike> {
    STRIKE.with_borrow_mut(|strike| {
        let sections = &mut strike.as_mut()?.sections;
        *sections = sections.saturating_sub(1);
        if *sections == 0 { strike.take() } else { None }
    })
}

pub(crate) fn worked_out(value: u8) -> u8 {
    value
}

pub(crate) fn part_sections() {}

pub(crate) fn head_and_above(masked: &Masked) -> (&'static ControlBlock, u8) {
    let head = KERNEL.ready.head.get(masked);
    (head, head.above.get(masked))
}

pub(crate) fn set_head(masked: &Masked, task: &'static ControlBlock) {
    KERNEL.ready.head.set(masked, task);
}

pub(crate) fn signal(masked: &Masked, semaphore: &Semaphore, may_strike: bool) -> bool {
    semaphore.signal(masked, may_strike)
}

pub(crate) fn make_ready(masked: &Masked, task: &'static ControlBlock) -> bool {
    if ready::preempt(masked, task) {
        return true;
    }
    if task.is_suspended(masked) {
        task.link.set(masked, Link::PARKED);
    } else {
        ready::append(masked, task);
    }
    false
}

pub(crate) fn arrive(masked: &Masked, task: &'static ControlBlock, _: bool) -> bool {
    if task.has_flag(masked, Flag::StandsIn) {
        return Group::of(masked, task).arrive(masked, task).is_some_and(|task| make_ready(masked, task));
    }
    make_ready(masked, task)
}

pub(crate) fn append<T: Pooled>(masked: &Masked, queue: &Queue<T>, slot: &'static Slot<T>) -> Appended {
    let signals = match queue.messages.word.get(masked) {
        State::Waiting => None,
        State::Signals(signals) => Some(signals),
        State::Empty => Some(0),
    };
    match signals {
        Some(signals) if signals >= queue.room => return Appended::NOT,
        Some(signals) => queue.messages.word.reset(masked, signals + 1),
        None => {}
    }
    slot.link.set(masked, None);
    match queue.first.get(masked).and(queue.last.get(masked)) {
        Some(last) => last.link.set(masked, Some(slot)),
        None => queue.first.set(masked, Some(slot)),
    }
    queue.last.set(masked, Some(slot));
    if signals.is_some() { Appended::STORED } else { Appended::AWAITED }
}

pub(crate) fn mask_anywhere<R>(body: impl FnOnce(&Masked) -> R) -> R {
    // SAFETY: what stands for interrupts runs only between tasks.
    body(&unsafe { Masked::assume() })
}

pub(crate) fn post(semaphore: &Semaphore, task: &mut Task) {
    if task.mask(|masked| semaphore.signal(masked, true)) {
        switch_from_call();
    }
}

pub(crate) fn wait(semaphore: &Semaphore, task: &mut Task) {
    if semaphore.block_until(task, None) == Came::Blocked {
        switch_from_call();
    }
}

pub(crate) fn enter_list(
    semaphore: &Semaphore,
    task: &mut Task,
    own: &'static ControlBlock,
    until: Option<&Until>,
) -> Came {
    semaphore.enter(task, own, until)
}

pub(crate) fn search<R>(
    context: &mut impl ThreadContext,
    task: &'static ControlBlock,
    suspension: Suspension,
    then: impl Fn(&Masked, Found) -> R,
) -> R {
    list::search(context, task, suspension, then)
}

pub(crate) fn resume(masked: &Masked, task: &'static ControlBlock) -> Option<bool> {
    let may = task.is_suspended(masked) && !task.has_flag(masked, Flag::Held);
    let priority = task.priority(masked);
    may.then(|| release(masked, task, priority, priority.above()))
}

pub(crate) fn release(masked: &Masked, task: &'static ControlBlock, priority: Priority, above: u8) -> bool {
    task.change_priority(masked, priority);
    task.clear_flag(masked, Flag::Held);
    task.above.set(masked, above);
    task.link.get(masked) == Link::PARKED && make_ready(masked, task)
}

pub(crate) fn withdraw(context: &mut impl ThreadContext, task: &'static ControlBlock) {
    list::withdraw(context, task);
}

pub(crate) fn yield_now(task: &mut Task) {
    if ready::rotate(task).is_some() {
        switch_from_call();
    }
}

pub(crate) fn arm(task: &mut Task, timer: &'static Timer, deadline: Ticks, target: Target) -> bool {
    timer::arm_by_steps(task, timer, deadline, target)
}

pub(crate) fn disarm(task: &mut Task, timer: &'static Timer) -> bool {
    timer.is_running(task) && timer::disarm_first(task, |next| ptr::eq(next, timer))
}

pub(crate) fn disarm_within(task: &mut Task, memory: Range<usize>) -> bool {
    timer::disarm_first(task, |next| memory.contains(&ptr::from_ref(next).addr()))
}

pub(crate) fn delay_until(task: &mut Task, deadline: Ticks) -> bool {
    let timer = Timer::new();
    // SAFETY: it outlives its use: this returns only after the timer has left the list, and a task's stack is
    // taken from it only when its timers have.
    let timer: &'static Timer = unsafe { &*ptr::from_ref(&timer) };
    let target = task.mask(|masked| Target::task(ready::running(masked)));
    let is_ahead = timer::arm_by_steps(task, timer, deadline, target);
    if is_ahead && ready::block_unless(task, Link::DELAYED, |masked| !timer.is_armed(masked)) {
        switch_from_call();
    }
    is_ahead
}

pub(crate) fn switch_from_call() {
    // A task that is dropped, or that failed, gives back what it holds and runs no other.
    if thread::panicking() {
        return;
    }
    // It is to strike this task only.
    let strike = STRIKE.take();
    let yielder = YIELDER.get();
    assert!(!yielder.is_null(), "a kernel call that may switch was made outside `run_for`");
    // SAFETY: the pointer is the running coroutine's own yielder, which lives as long as it does.
    unsafe { (*yielder).suspend(()) };
    YIELDER.set(yielder);
    STRIKE.set(strike);
}

pub(crate) fn leave(_: &Masked) -> ! {
    loop {
        switch_from_call();
    }
}

/// The clock of tasks' times: none passes while a task runs.
#[cfg(feature = "cpu-time")]
pub(crate) fn clock(_: &Masked) -> u16 {
    0
}

/// Where the stack of `task`'s coroutine lies.
pub(crate) fn stack(task: &'static ControlBlock, _: usize) -> Range<usize> {
    // SAFETY: what stands for interrupts runs only where a test calls it.
    let index = task.stack_pointer.get(&unsafe { Masked::assume() });
    STACKS.with_borrow(|stacks| {
        index.checked_sub(FIRST_TASK).and_then(|index| stacks.get(index)).cloned().unwrap_or(0..0)
    })
}

/// The `stack_pointer` of a task that is to begin.
pub(crate) struct Laid(usize);

/// Any stack will do: the task gets one of its own.
pub(crate) const fn fits(_body: usize, _bytes: usize) -> bool {
    true
}

/// # Safety
/// As on the AVR.
pub(crate) unsafe fn lay_body<F, const BYTES: usize>(_: *mut [MaybeUninit<u8>; BYTES], body: F) -> Laid
where
    F: FnOnce(&mut Task) -> Never + 'static,
{
    let body = Box::new(body);
    let stack = DefaultStack::default();
    STACKS.with_borrow_mut(|stacks| stacks.push(stack.limit().get()..stack.base().get()));
    let coroutine = Coroutine::with_stack(stack, move |yielder: &Yielder<(), ()>, ()| {
        YIELDER.set(yielder);
        // SAFETY: this is the task, and it has just started.
        body(&mut unsafe { Task::assume() })
    });
    TASKS.with_borrow_mut(|tasks| {
        tasks.push(Some(coroutine));
        Laid(tasks.len() - 1 + FIRST_TASK)
    })
}

pub(crate) fn lay_context(_: &ControlBlock, laid: Laid) -> usize {
    laid.0
}
