//! The start of tasks, and of the kernel.

use core::arch::asm;
use core::mem::{MaybeUninit, size_of};
use core::ops::Range;
use core::ptr;

use super::PROGRAM_COUNTER;
use super::switch::kernel_run_head;
use crate::context::Task;
use crate::control_block::ControlBlock;
use crate::critical::Masked;
use crate::stack_watermark::WATERMARK;
use crate::task;

/// From here on until the first task interrupts are masked.
#[inline(always)]
pub(crate) fn begin() {
    super::disable_interrupts();
}

/// Every task goes on.
#[inline(always)]
pub(crate) fn may_block() {}

/// Resumes the head; idles while no task is ready.
pub(crate) fn run_head(_: &Masked) -> ! {
    // SAFETY: interrupts are masked, and nothing of what ran is needed again: a task that has ended, or
    // `main`, whose stack is the kernel's from here on.
    unsafe { kernel_run_head() }
}

/// Where the stack of `task` lies, that has `bytes`: behind its control block.
pub(crate) fn stack(task: &'static ControlBlock, bytes: usize) -> Option<Range<usize>> {
    let bottom = ptr::from_ref(task).addr() + size_of::<ControlBlock>();
    Some(bottom..bottom + bytes)
}

/// The bytes of a first context: a voluntary one, and the entry that `kernel_start_task` pops.
const FIRST_CONTEXT: usize = PROGRAM_COUNTER + 4;

/// Whether a stack of `bytes` can hold a body of so many and a first context.
pub(crate) const fn fits(body: usize, bytes: usize) -> bool {
    bytes >= body + FIRST_CONTEXT
}

/// Lays `body` at the top of `memory`, its first context below, and the watermark into the rest. Returns the
/// stack pointer. About 8 cycles a byte.
///
/// # Safety
/// It must fit, and nothing else may use `memory`, which lies behind `task`.
#[inline(always)]
pub(crate) unsafe fn init_context<F, R, const BYTES: usize>(
    _: &'static ControlBlock,
    memory: *mut [MaybeUninit<u8>; BYTES],
    body: F,
) -> usize
where
    F: FnOnce(&mut Task) -> R + Send + 'static,
{
    record::<F, R, BYTES>();
    let bottom = memory.cast::<u8>();
    // SAFETY: the caller's promise; alignment is 1 throughout on the AVR.
    unsafe {
        let place = bottom.add(BYTES - size_of::<F>());
        place.cast::<F>().write(body);
        lay_context(bottom, place, enter::<F, R> as *const () as usize)
    }
}

/// Lays the first context below `body`, and the watermark from `bottom` on. Returns the stack pointer.
///
/// # Safety
/// Between the two there is room for a first context, and nothing else uses it.
#[inline(never)]
unsafe fn lay_context(bottom: *mut u8, body: *mut u8, entry: usize) -> usize {
    let [start_low, start_high] = (kernel_start_task as *const () as usize).to_le_bytes();
    let [body_low, body_high] = body.addr().to_le_bytes();
    let [entry_low, entry_high] = entry.to_le_bytes();
    let mut place = body;
    let mut push = |byte: u8| {
        place = place.wrapping_sub(1);
        // SAFETY: one of the bytes of the first context, for which the caller promises room.
        unsafe { place.write(byte) };
    };
    // From the top down: what `kernel_start_task` pops, its address, and Y, which is the body.
    push(entry_high);
    push(entry_low);
    push(start_low);
    push(start_high);
    if PROGRAM_COUNTER == 3 {
        push(0); // functions have addresses of 16 bits
    }
    push(body_low);
    push(body_high);
    let stack_pointer = place.addr() - 1; // SP points at the free byte below what `pop` takes next
    let mut free = bottom;
    while free.addr() <= stack_pointer {
        // SAFETY: from the stack's first byte up to the first context.
        unsafe { free.write(WATERMARK) };
        free = free.wrapping_add(1);
    }
    stack_pointer
}

/// Where a task starts, where [`lay_context`] leads: Y is its body, and its entry lies on the stack.
#[unsafe(no_mangle)]
#[inline(never)]
unsafe extern "C" fn kernel_start_task() {
    // SAFETY: a first context leads here.
    unsafe {
        asm!(
            "movw r24, r28", // 1: r25:r24 = the body, the first argument of `enter`
            "pop r30",       // 2: Z = the address of `enter` in words
            "pop r31",       // 2
            "ijmp",          // 2
        )
    }
}

/// Leaves a record for `stack-bound`, which computes how much stack each task needs: where a task's code
/// begins, how many bytes it captured, how many its stack has. The section stays in the ELF file: no flash,
/// no RAM, no cycle.
#[inline(always)]
fn record<F, R, const BYTES: usize>()
where
    F: FnOnce(&mut Task) -> R + Send + 'static,
{
    // SAFETY: no instruction.
    unsafe {
        asm!(
            ".pushsection .debug_tasks, \"\", @progbits", // `.debug`, or the linker drops what nothing refers to
            ".long {entry}",
            ".short {captured}, {bytes}",
            ".popsection",
            entry = sym enter::<F, R>,
            captured = const size_of::<F>(),
            bytes = const BYTES,
            options(nomem, nostack, preserves_flags),
        )
    }
}

/// A task is never dropped.
#[inline(always)]
pub(crate) fn when_dropped(_: impl FnMut()) -> impl Sized {}

/// Has the linker ask for the tick's vector, where code is linked that waits for a tick: "undefined reference
/// to `kernel_needs_tick_interrupt`" without one. No flash, no RAM, no cycle.
#[inline(always)]
pub(crate) fn need_tick() {
    // SAFETY: no instruction.
    unsafe {
        asm!(".reloc ., R_AVR_NONE, kernel_needs_tick_interrupt", options(nomem, nostack, preserves_flags),)
    }
}

/// The first code of a task, with interrupts enabled: takes the body from where `init_context` laid it.
extern "C" fn enter<F, R>(place: *mut F) -> !
where
    F: FnOnce(&mut Task) -> R + Send + 'static,
{
    // SAFETY: `init_context` wrote it there, and a task starts once.
    let body = unsafe { place.read() };
    // SAFETY: this is the task, and it has just started.
    let task = &mut unsafe { Task::assume() };
    body(task);
    task::finish(task)
}
