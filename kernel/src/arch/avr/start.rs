//! The start of tasks, and of the kernel.

use core::arch::asm;
use core::mem::{MaybeUninit, size_of};
use core::ops::Range;
use core::ptr;

use super::PROGRAM_COUNTER;
use super::switch::kernel_run_head;
use crate::context::Task;
use crate::control_block::ControlBlock;
use crate::critical::{Masked, MaskedCell};
use crate::stack_watermark::WATERMARK;
use crate::task;

/// Masks interrupts until the first task runs, unless the kernel `runs` already. Returns whether it did.
#[inline(always)]
pub(crate) fn begin(runs: &MaskedCell<bool>) -> bool {
    let is_first = !super::critical(|masked| runs.replace(masked, true));
    if is_first {
        super::disable_interrupts();
    }
    is_first
}

/// Every task can be resumed.
#[inline(always)]
pub(crate) fn may_block() {}

/// Resumes the head; idles while no task is ready.
pub(crate) fn run_head(_: &Masked) -> ! {
    // SAFETY: interrupts are masked, and the caller's context is not needed again: it is a task that has
    // ended, or `main`, whose stack becomes the kernel's.
    unsafe { kernel_run_head() }
}

/// The address range of the stack of `task`, of `bytes` bytes, behind its control block.
pub(crate) fn stack(task: &'static ControlBlock, bytes: usize) -> Option<Range<usize>> {
    let bottom = ptr::from_ref(task).addr() + size_of::<ControlBlock>();
    Some(bottom..bottom + bytes)
}

/// The bytes of a first context: a voluntary one, and the entry that `kernel_start_task` pops.
const FIRST_CONTEXT: usize = PROGRAM_COUNTER + 4;

/// Whether a stack of `bytes` can hold a body of `body` bytes and a first context.
pub(crate) const fn fits(body: usize, bytes: usize) -> bool {
    bytes >= body + FIRST_CONTEXT
}

/// Writes `body` to the top of `memory`, its first context below, and the watermark into the rest. Returns
/// the stack pointer. About 8 cycles a byte.
///
/// # Safety
/// Both must fit. Nothing else may use `memory`, which lies behind the task's control block.
#[inline(always)]
pub(crate) unsafe fn init_context<F, R, const BYTES: usize>(
    _: &'static ControlBlock,
    memory: *mut [MaybeUninit<u8>; BYTES],
    body: F,
) -> usize
where
    F: FnOnce(&mut Task) -> R + Send + 'static,
{
    // All types have this alignment on the AVR that do not ask for more.
    const { assert!(align_of::<F>() == 1, "what a task captures must have an alignment of 1") };
    record::<F, R, BYTES>();
    let bottom = memory.cast::<u8>();
    // SAFETY: the caller guarantees the room, and the alignment of the body is 1.
    unsafe {
        let place = bottom.add(BYTES - size_of::<F>());
        place.cast::<F>().write(body);
        lay_context(bottom, place, enter::<F, R> as *const () as usize)
    }
}

/// Writes the first context below `body`, and the watermark from `bottom` up. Returns the stack pointer.
///
/// # Safety
/// A first context must fit between the two, and nothing else may use that memory.
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
    // From the top down: the entry that `kernel_start_task` pops, its own address as PC, and the body as Y.
    push(entry_high);
    push(entry_low);
    push(start_low);
    push(start_high);
    if PROGRAM_COUNTER == 3 {
        push(0); // function pointers have 16 bits
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

/// A task's first code, to which the first context returns: Y is the body, the entry is on the stack.
#[unsafe(no_mangle)]
#[inline(never)]
unsafe extern "C" fn kernel_start_task() {
    // SAFETY: only a first context returns here.
    unsafe {
        asm!(
            "movw r24, r28", // 1: r25:r24 = the body, the first argument of `enter`
            "pop r30",       // 2: Z = the address of `enter` in words
            "pop r31",       // 2
            "ijmp",          // 2
        )
    }
}

/// Emits a record for `stack-bound`, which computes how much stack each task needs: where the task's code
/// begins, how many bytes it captures, and the size of its stack. The section stays in the ELF file: no
/// flash, no RAM, no cycle.
#[inline(always)]
fn record<F, R, const BYTES: usize>()
where
    F: FnOnce(&mut Task) -> R + Send + 'static,
{
    // SAFETY: emits no instruction.
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

/// Makes the linker require the tick's vector wherever code is linked that waits for a tick: "undefined
/// reference to `kernel_needs_tick_interrupt`" without one. No flash, no RAM, no cycle.
#[inline(always)]
pub(crate) fn need_tick() {
    // SAFETY: emits no instruction.
    unsafe {
        asm!(".reloc ., R_AVR_NONE, kernel_needs_tick_interrupt", options(nomem, nostack, preserves_flags),)
    }
}

/// Runs the task's body, with interrupts enabled: moves it from where `init_context` has written it.
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
