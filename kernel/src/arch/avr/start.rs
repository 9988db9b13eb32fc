//! The start of the kernel and of tasks, and their end.

use core::arch::asm;
use core::mem::{MaybeUninit, size_of};
use core::ops::Range;
use core::ptr;

use super::PROGRAM_COUNTER;
use super::switch::kernel_run;
use crate::context::Task;
use crate::masked::Masked;
use crate::paint::paint;
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

/// Lays `body` and a first context at the top of `memory`. Returns the stack pointer, or `None` if they do not fit.
pub(crate) fn prepare<F, const BYTES: usize>(memory: &mut [MaybeUninit<u8>; BYTES], body: F) -> Option<usize>
where
    F: FnOnce(&mut Task) -> Never + 'static,
{
    record::<F, BYTES>();
    let (rest, place) = memory.split_at_mut_checked(BYTES.checked_sub(size_of::<F>())?)?;
    let (below, context) = rest.split_last_chunk_mut::<FIRST_CONTEXT>()?;
    let place = place.as_mut_ptr().cast::<F>();
    // SAFETY: `place` has the size of `F`, alignment is 1 throughout on the AVR, and nothing else uses it.
    unsafe { place.write(body) };
    lay_context(context, enter::<F> as *const () as usize, place as usize);
    paint(below);
    // SP points at the free byte below what `pop` takes next.
    Some(below.as_ptr_range().end as usize - 1)
}

/// The bytes of a first context: a voluntary one, and what `kernel_start_task` pops.
const FIRST_CONTEXT: usize = PROGRAM_COUNTER + 4;

/// Where a task starts, laid here by [`prepare`]: Y is its body, and its entry lies on the stack.
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

/// Lays the context of a task that begins at `entry` with its body at `place`.
#[inline(never)] // each start of a task would hold it
fn lay_context(context: &mut [MaybeUninit<u8>; FIRST_CONTEXT], entry: usize, place: usize) {
    // SAFETY: it writes as many bytes, and changes nothing else.
    unsafe {
        asm!(
            "st Z+, {place:h}",             // 2: Y
            "st Z+, {place:l}",             // 2
            #[cfg(target_feature = "eijmpcall")]
            "st Z+, r1",                    // 2: bits 16 to 21 of the program counter
            "ldi {byte}, hi8(gs({start}))", // 1: and the others
            "st Z+, {byte}",                // 2
            "ldi {byte}, lo8(gs({start}))", // 1
            "st Z+, {byte}",                // 2
            "st Z+, {entry:l}",             // 2
            "st Z, {entry:h}",              // 2
            start = sym kernel_start_task,
            inout("Z") context.as_mut_ptr() => _,
            place = in(reg_pair) place,
            entry = in(reg_pair) entry,
            byte = out(reg_upper) _,
            options(nostack, preserves_flags),
        );
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

/// The first code of a task, with interrupts enabled: takes the body from where `prepare` laid it.
extern "C" fn enter<F>(place: *mut F) -> !
where
    F: FnOnce(&mut Task) -> Never + 'static,
{
    // SAFETY: `prepare` wrote the body there, and a task starts once.
    let body = unsafe { place.read() };
    // SAFETY: this is the task, and it has just started.
    match body(&mut unsafe { Task::assume() }) {}
}
