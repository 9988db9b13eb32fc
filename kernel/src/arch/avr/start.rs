//! The start of the kernel and of tasks, and their end.

use core::arch::asm;
use core::mem::{MaybeUninit, size_of};
use core::ops::Range;
use core::ptr;

use super::PROGRAM_COUNTER;
use super::switch::kernel_run;
use crate::context::Task;
use crate::masked::Masked;
use crate::paint::PAINT;
use crate::task::{ControlBlock, Never};

/// Runs the tasks; idles while none is ready.
pub(crate) fn run() -> ! {
    // SAFETY: interrupts are masked, and `main`, whose stack this takes, never gets control back.
    unsafe { kernel_run() }
}

/// Runs the tasks; the running one, which is not ready any more, is forgotten.
pub(crate) fn leave(_: &Masked) -> ! {
    // SAFETY: interrupts are masked, and nothing of the task that calls this is needed again.
    unsafe { kernel_run() }
}

/// Where the stack of `task` lies, that has `bytes`.
pub(crate) fn stack(task: &'static ControlBlock, bytes: usize) -> Range<usize> {
    let bottom = ptr::from_ref(task).addr() + size_of::<ControlBlock>();
    bottom..bottom + bytes
}

/// The bytes of a first context: a voluntary one, and what `kernel_start_task` pops.
const FIRST_CONTEXT: usize = PROGRAM_COUNTER + 4;

/// Whether a stack of `bytes` can hold a body of so many and a first context.
pub(crate) const fn fits(body: usize, bytes: usize) -> bool {
    bytes >= body + FIRST_CONTEXT
}

/// A task whose body lies at the top of its stack, and has no context yet.
pub(crate) struct Laid {
    /// Where its first context goes: below the body.
    context: usize,
    /// Its code.
    entry: usize,
}

/// Lays `body` at the top of `memory`.
///
/// # Safety
/// It must fit, and nothing else may use `memory`.
#[inline(always)]
pub(crate) unsafe fn lay_body<F, const BYTES: usize>(memory: *mut [MaybeUninit<u8>; BYTES], body: F) -> Laid
where
    F: FnOnce(&mut Task) -> Never + 'static,
{
    record::<F, BYTES>();
    // SAFETY: the caller's promise; alignment is 1 throughout on the AVR.
    let place = unsafe {
        let place = memory.cast::<u8>().add(BYTES - size_of::<F>()).cast::<F>();
        place.write(body);
        place
    };
    Laid { context: place.addr() - FIRST_CONTEXT, entry: enter::<F> as *const () as usize }
}

/// Lays the first context of `task`, and paints what is free of its stack: 6 cycles a byte. Returns the stack pointer.
#[inline(always)]
pub(crate) fn lay_context(task: &'static ControlBlock, laid: Laid) -> usize {
    let place: usize;
    // SAFETY: it writes to the task's stack, from its first byte to the body. That is claimed, and nobody else's.
    unsafe {
        asm!(
            "rjmp 2f",                      // 2
            "1:",
            "st X+, {byte}",                // 2
            "2:",
            "cp r26, {place:l}",            // 1
            "cpc r27, {place:h}",           // 1
            "brne 1b",                      // 2, or 1 where the context goes
            "adiw {place}, {first_context}", // 2: the body lies behind it
            "st X+, {place:h}",             // 2: Y
            "st X+, {place:l}",             // 2
            #[cfg(target_feature = "eijmpcall")]
            "st X+, r1",                    // 2: bits 16 to 21 of the program counter
            "ldi {byte}, hi8(gs({start}))", // 1: and the others
            "st X+, {byte}",                // 2
            "ldi {byte}, lo8(gs({start}))", // 1
            "st X+, {byte}",                // 2
            "st X+, {entry:l}",             // 2
            "st X, {entry:h}",              // 2
            start = sym kernel_start_task,
            first_context = const FIRST_CONTEXT,
            inout("X") ptr::from_ref(task).addr() + size_of::<ControlBlock>() => _,
            place = inout(reg_iw) laid.context => place,
            entry = in(reg_pair) laid.entry,
            byte = inout(reg_upper) PAINT => _,
            options(nostack),
        );
    }
    // SP points at the free byte below what `pop` takes next.
    place - FIRST_CONTEXT - 1
}

/// Where a task starts, where [`lay_context`] leads: Y is its body, and its entry lies on the stack.
#[unsafe(no_mangle)]
#[inline(never)]
unsafe extern "C" fn kernel_start_task() {
    // SAFETY: a first context leads here.
    unsafe {
        asm!(
            "movw r24, r28", // 1: the first argument
            "pop r30",       // 2
            "pop r31",       // 2
            "ijmp",          // 2
        )
    }
}

/// Leaves a record for `stack-bound`, which computes how much stack each task needs: where a task's code begins, how
/// many bytes it captured, how many its stack has. The section stays in the ELF file: no flash, no RAM, no cycle.
#[inline(always)]
fn record<F, const BYTES: usize>()
where
    F: FnOnce(&mut Task) -> Never + 'static,
{
    // SAFETY: no instruction.
    unsafe {
        asm!(
            ".pushsection .debug_tasks, \"\", @progbits", // `.debug`, or the linker drops what nothing refers to
            ".long {entry}",
            ".short {captured}, {bytes}",
            ".popsection",
            entry = sym enter::<F>,
            captured = const size_of::<F>(),
            bytes = const BYTES,
            options(nomem, nostack, preserves_flags),
        )
    }
}

/// The first code of a task, with interrupts enabled: takes the body from where `lay_body` laid it.
extern "C" fn enter<F>(place: *mut F) -> !
where
    F: FnOnce(&mut Task) -> Never + 'static,
{
    // SAFETY: `lay_body` wrote it there, and a task starts once.
    let body = unsafe { place.read() };
    // SAFETY: this is the task, and it has just started.
    match body(&mut unsafe { Task::assume() }) {}
}
