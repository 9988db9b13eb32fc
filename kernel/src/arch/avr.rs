//! The classic AVR with a 16-bit program counter (ATmega128 datasheet, "AVR CPU Core").
//!
//! # Two kinds of context
//! A task that blocks does so at a place the compiler knows: [`switch`] tells it that every register is
//! lost there, and the compiler keeps what it needs, no more. So a *voluntary* context is the return address
//! and Y, which can't be declared lost: 4 bytes. An interrupt strikes anywhere: its *preempted* context is
//! all 32 registers, SREG and the program counter, 35 bytes. Bit 15 of the saved stack pointer, which no
//! SRAM address needs, tells which it is.
//!
//! ```text
//!   voluntary: r28 r29 PC
//!   preempted: PC r31 r30 r0 SREG r1 r18..r27 r28 r29 | r2..r17
//! ```
//!
//! # Interrupts
//! An interrupt pushes what a call may change and Y onto the stack it found (19 bytes with the PC), then moves
//! to the kernel's stack, so that handlers cost no task any stack, and calls the handler. Only if that made
//! a higher task ready are the other 16 registers saved, and that task's context is restored instead. Handlers do not nest.
//!
//! # Stacks
//! The kernel's stack is what `main` started on: the top of SRAM, growing down to the end of `.bss`. Its
//! first [`IDLE_STACK`] bytes are the idle task's, which needs room for one preempted context. That task has nothing
//! to remember: it is begun anew each time, so its stack also serves to take up other tasks' contexts.
//!
//! Cycle counts in the comments are those of the instruction beside them.

use core::arch::asm;
use core::mem::{MaybeUninit, size_of};

use crate::context::Task;
use crate::masked::Masked;
use crate::task::Never;
use crate::{IDLE, KERNEL, Kernel};

/// Bytes at the top of the kernel's stack that are the idle task's: a preempted context.
const IDLE_STACK: usize = 35;

/// The stack pointer of the idle task's control block: marked as preempted, which leads to where it begins anew.
pub(crate) const IDLE_CONTEXT: usize = 0x8000;

/// Offsets of what the assembly reads, in bytes.
const HEAD: usize = core::mem::offset_of!(Kernel, ready.head);
const RUNNING: usize = core::mem::offset_of!(Kernel, ready.running);

/// `cli`: 1 cycle.
#[inline(always)]
pub(crate) fn disable_interrupts() {
    // SAFETY: masking interrupts breaks no invariant; as a compiler barrier it keeps what follows behind it.
    unsafe { asm!("cli", options(nostack)) }
}

/// `sei`: 1 cycle; the instruction after it still runs before any interrupt.
#[inline(always)]
pub(crate) fn enable_interrupts() {
    // SAFETY: called only by `Task::mask` and the start, whose callers run with interrupts enabled or unshared state.
    unsafe { asm!("sei", options(nostack)) }
}

/// Runs `body` with interrupts masked, and leaves them as they were.
#[inline(always)]
pub(crate) fn mask_anywhere<R>(body: impl FnOnce(&Masked) -> R) -> R {
    let status: u8;
    // SAFETY: reads SREG and masks interrupts.
    unsafe {
        asm!(
            "in {status}, 0x3f", // 1: SREG, with I as it was
            "cli",               // 1
            status = out(reg) status,
            options(nostack),
        );
    }
    // SAFETY: interrupts were just masked, and are restored only after `body`.
    let result = body(&unsafe { Masked::assume() });
    // SAFETY: puts SREG back as it was found.
    unsafe { asm!("out 0x3f, {status}", status = in(reg) status, options(nostack)) } // 1
    result
}

/// The context switch, with the other entries that share its instructions.
///
/// Not a naked function: rustc turns those into module-level assembly, which LLVM 22 checks against a bare
/// AVR1 (no `push`) when it writes the bitcode of a library. In a function without locals or clobbers the
/// compiler adds nothing but a `ret`, and a test of the image holds it to that.
#[unsafe(no_mangle)]
#[inline(never)]
#[expect(
    named_asm_labels,
    reason = "other code jumps to them, and a function that is not inlined stands once"
)]
unsafe extern "C" fn kernel_switch() {
    // SAFETY: a task calls this with interrupts enabled. It returns as a call would, with the call-saved
    // registers and the stack as they were, when the task runs again.
    unsafe {
        asm!(
            // Saves the running task's stack pointer and takes up the head's context. Y is on the stack.
            "lds r26, {kernel}+{running}",        // 2: X = the running task's control block: its own
            "lds r27, {kernel}+{running}+1",      // 2
            "in r24, 0x3d",                       // 1: r25:r24 = SP
            "in r25, 0x3e",                       // 1: its bit 15 is clear: voluntary
            "cli",                                // 1
            "st X+, r24",                         // 2: its stack pointer
            "st X, r25",                          // 2
            // Takes up the context of the head. Interrupts are masked, and what ran is saved or not needed.
            "resume_head:",
            "lds r30, {kernel}+{head}",           // 2: Z = the head's control block
            "lds r31, {kernel}+{head}+1",         // 2
            "resume_z:",
            "ld r24, Z",                          // 2: r25:r24 = its stack pointer
            "ldd r25, Z+1",                       // 2
            "sbrc r25, 7",                        // 2: skips the next for a voluntary context
            "rjmp resume_preempted",              // 2
            "sts {kernel}+{running}, r30",        // 2: now it is the running one
            "sts {kernel}+{running}+1, r31",      // 2
            "out 0x3e, r25",                      // 1: SPH
            "sei",                                // 1: takes effect after the next instruction,
            "out 0x3d, r24",                      // 1: SPL: so the stack is whole before any interrupt
            "ret",                                // 4: to the task's `switch`
            // The idle task, with interrupts enabled.
            "idle:",
            "sei",                                // 1: takes effect after the next instruction,
            "sleep",                              // 1: so that no interrupt comes between the two
            "rjmp idle",                          // 2
            // Half of a preempted context is loaded as the idle task would: on its stack, with interrupts enabled.
            // One that strikes here finds that the idle task runs and the head should, and begins this anew.
            "resume_preempted:",
            "ldi r26, lo8({idle_task})",          // 1: X = the idle task's control block
            "ldi r27, hi8({idle_task})",          // 1
            "sts {kernel}+{running}, r26",        // 2
            "sts {kernel}+{running}+1, r27",      // 2
            "ldi r18, lo8(__stack)",              // 1: the idle task's stack, empty
            "ldi r19, hi8(__stack)",              // 1
            "out 0x3e, r19",                      // 1: SPH
            "sei",                                // 1
            "out 0x3d, r18",                      // 1: SPL
            "cp r30, r26",                        // 1: is the head the idle task?
            "cpc r31, r27",                       // 1
            "breq idle",                          // 1, or 2
            "andi r25, 0x7f",                     // 1: the stack pointer without its mark
            "movw r30, r24",                      // 1: Z = the byte below the context
            "ldd r17, Z+1",                       // 2
            "ldd r16, Z+2",                       // 2
            "ldd r15, Z+3",                       // 2
            "ldd r14, Z+4",                       // 2
            "ldd r13, Z+5",                       // 2
            "ldd r12, Z+6",                       // 2
            "ldd r11, Z+7",                       // 2
            "ldd r10, Z+8",                       // 2
            "ldd r9, Z+9",                        // 2
            "ldd r8, Z+10",                       // 2
            "ldd r7, Z+11",                       // 2
            "ldd r6, Z+12",                       // 2
            "ldd r5, Z+13",                       // 2
            "ldd r4, Z+14",                       // 2
            "ldd r3, Z+15",                       // 2
            "ldd r2, Z+16",                       // 2
            "adiw r24, 16",                       // 2: as if they had been popped
            "cli",                                // 1: an interrupt from here on would lay a context behind this one
            "lds r30, {kernel}+{head}",           // 2: the same as before: no interrupt struck
            "lds r31, {kernel}+{head}+1",         // 2
            "sts {kernel}+{running}, r30",        // 2
            "sts {kernel}+{running}+1, r31",      // 2
            "out 0x3e, r25",                      // 1: SPH
            "out 0x3d, r24",                      // 1: SPL
            #[cfg(feature = "fault-early-enable")]
            "sei",
            "rjmp leave_interrupt",               // 2
            // Enters an interrupt: r31 and r30 are on the stack, Z is the handler's address in words.
            ".global kernel_enter_interrupt",
            "kernel_enter_interrupt:",
            "push r0",                            // 2
            "in r0, 0x3f",                        // 1: SREG; I is clear in it, `reti` sets it
            "push r0",                            // 2
            "push r1",                            // 2
            "clr r1",                             // 1: compiled code counts on r1 = 0
            "push r18",                           // 2: what a call may change, and Y
            "push r19",                           // 2
            "push r20",                           // 2
            "push r21",                           // 2
            "push r22",                           // 2
            "push r23",                           // 2
            "push r24",                           // 2
            "push r25",                           // 2
            "push r26",                           // 2
            "push r27",                           // 2
            "push r28",                           // 2
            "push r29",                           // 2
            "in r28, 0x3d",                       // 1: Y = SP of the interrupted task; the handler preserves it
            "in r29, 0x3e",                       // 1
            "ldi r24, lo8(__stack - {idle})",     // 1: the kernel's stack, empty: handlers do not nest
            "ldi r25, hi8(__stack - {idle})",     // 1
            "out 0x3e, r25",                      // 1: SPH
            "out 0x3d, r24",                      // 1: SPL
            "icall",                              // 3: the handler
            "lds r30, {kernel}+{head}",           // 2: Z = the task that should run
            "lds r31, {kernel}+{head}+1",         // 2
            "lds r26, {kernel}+{running}",        // 2: X = the task that does
            "lds r27, {kernel}+{running}+1",      // 2
            "out 0x3e, r29",                      // 1: SPH, back to the interrupted stack
            "out 0x3d, r28",                      // 1: SPL
            "cp r30, r26",                        // 1
            "cpc r31, r27",                       // 1
            "brne preempt",                       // 1, or 2 to switch
            // Leaves an interrupt to the task on whose stack the rest of a preempted context lies.
            "leave_interrupt:",
            "pop r29",                            // 2
            "pop r28",                            // 2
            "pop r27",                            // 2
            "pop r26",                            // 2
            "pop r25",                            // 2
            "pop r24",                            // 2
            "pop r23",                            // 2
            "pop r22",                            // 2
            "pop r21",                            // 2
            "pop r20",                            // 2
            "pop r19",                            // 2
            "pop r18",                            // 2
            "pop r1",                             // 2
            "pop r0",                             // 2: SREG
            "out 0x3f, r0",                       // 1
            "pop r0",                             // 2
            "pop r30",                            // 2
            "pop r31",                            // 2
            "reti",                               // 4: and I set
            // Saves the other half of a preempted context; X is the running task's control block.
            "preempt:",
            "push r2",                            // 2
            "push r3",                            // 2
            "push r4",                            // 2
            "push r5",                            // 2
            "push r6",                            // 2
            "push r7",                            // 2
            "push r8",                            // 2
            "push r9",                            // 2
            "push r10",                           // 2
            "push r11",                           // 2
            "push r12",                           // 2
            "push r13",                           // 2
            "push r14",                           // 2
            "push r15",                           // 2
            "push r16",                           // 2
            "push r17",                           // 2
            "in r24, 0x3d",                       // 1: r25:r24 = SP
            "in r25, 0x3e",                       // 1
            "ori r25, 0x80",                      // 1: preempted
            "st X+, r24",                         // 2
            "st X, r25",                          // 2
            "rjmp resume_z",                      // 2: Z is the head already
                // Where a task starts: its body and its entry lie on the stack, laid there by `prepare`.
            "kernel_start_task:",
            "pop r24",                            // 2: the first argument
            "pop r25",                            // 2
            "pop r30",                            // 2
            "pop r31",                            // 2
            "ijmp",                               // 2
            // The start: the idle task is the running one, and `main`'s stack is not needed any more.
            ".global kernel_run",
            "kernel_run:",
            "rjmp resume_head",                   // 2
            kernel = sym KERNEL,
            idle_task = sym IDLE,
            head = const HEAD,
            running = const RUNNING,
            idle = const IDLE_STACK,
        )
    }
}

unsafe extern "C" {
    fn kernel_start_task();
    fn kernel_run() -> !;
    #[doc(hidden)]
    pub fn kernel_enter_interrupt();
}

/// Saves the running task's context and takes up the head's; returns when this task runs again.
///
/// 48 cycles to a task that blocked likewise, of which 26 masked. If an interrupt has made the switch first,
/// this one is to the task itself, and comes back at once.
///
/// Every register but Y is lost here, so a function that inlines this saves what it must preserve: right for
/// the loop of a task, which must preserve nothing. Elsewhere [`switch_from_call`] costs less.
#[inline(always)]
pub(crate) fn switch() {
    // SAFETY: a task calls this, with interrupts enabled. All that changes meanwhile is declared.
    unsafe {
        asm!(
            "push r28",             // 2: Y, which the compiler needs and can't be told is lost
            "push r29",             // 2
            "call {switch}",        // 4
            "pop r29",              // 2
            "pop r28",              // 2
            switch = sym kernel_switch,
            out("r2") _, out("r3") _, out("r4") _, out("r5") _, out("r6") _, out("r7") _,
            out("r8") _, out("r9") _, out("r10") _, out("r11") _, out("r12") _, out("r13") _,
            out("r14") _, out("r15") _, out("r16") _, out("r17") _, out("r18") _, out("r19") _,
            out("r20") _, out("r21") _, out("r22") _, out("r23") _, out("r24") _, out("r25") _,
            out("r26") _, out("r27") _, out("r30") _, out("r31") _,
        )
    }
}

/// [`switch`] for a function that seldom gets there: 64 cycles more, but none where it is not called.
#[inline(never)]
pub(crate) fn switch_from_call() {
    switch();
}

/// Runs the tasks; idles while none is ready.
pub(crate) fn run() -> ! {
    // SAFETY: interrupts are masked, and `main`, whose stack this takes, never gets control back.
    unsafe { kernel_run() }
}

/// Lays `body` and a first context at the top of `memory`. Returns the stack pointer, or `None` if they do not fit.
pub(crate) fn prepare<F, const BYTES: usize>(memory: &mut [MaybeUninit<u8>; BYTES], body: F) -> Option<usize>
where
    F: FnOnce(&mut Task) -> Never + 'static,
{
    record::<F, BYTES>();
    /// The program counter, and what `kernel_start_task` pops.
    const CONTEXT: usize = 6;
    let (rest, place) = memory.split_at_mut_checked(BYTES.checked_sub(size_of::<F>())?)?;
    let (below, context) = rest.split_at_mut_checked(rest.len().checked_sub(CONTEXT)?)?;
    let place = place.as_mut_ptr().cast::<F>();
    // SAFETY: `place` has the size of `F`, alignment is 1 throughout on the AVR, and nothing else uses it.
    unsafe { place.write(body) };
    let [start_low, start_high] = (kernel_start_task as *const () as usize).to_le_bytes();
    let [place_low, place_high] = (place as usize).to_le_bytes();
    let [entry_low, entry_high] = (enter::<F> as *const () as usize).to_le_bytes();
    let first = [start_high, start_low, place_low, place_high, entry_low, entry_high];
    for (slot, value) in context.iter_mut().zip(first) {
        slot.write(value);
    }
    // SP points at the free byte below what `pop` takes next.
    Some(below.as_ptr_range().end as usize - 1)
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

/// Declares interrupt handlers. Each runs on the kernel's stack with interrupts masked, and gets an
/// [`Interrupt`](crate::Interrupt) to make kernel calls with.
///
/// ```ignore
/// kernel::interrupt! {
///     /// USART0 has received a byte.
///     fn __vector_18(interrupt) { RECEIVED.post(interrupt); }
/// }
/// ```
/// The names are the linker's: `__vector_` and the vector's number (ATmega128 datasheet, "Interrupts", counted from 0).
#[macro_export]
macro_rules! interrupt {
    ($($(#[$attribute:meta])* fn $vector:ident($interrupt:ident) $body:block)*) => {$(
        $(#[$attribute])*
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $vector() -> ! {
            extern "C" fn handler() {
                // SAFETY: only the vector calls this, with interrupts masked.
                let $interrupt = &mut unsafe { $crate::Interrupt::assume() };
                $body
            }
            // SAFETY: the hardware comes here, and `kernel_enter_interrupt` restores all that the handler may change.
            unsafe { core::arch::asm!(
                "push r31",               // 2
                "push r30",               // 2
                "ldi r30, lo8(gs({handler}))", // 1: Z = the handler, in words
                "ldi r31, hi8(gs({handler}))", // 1
                "jmp {enter}",            // 3
                handler = sym handler,
                enter = sym $crate::arch::kernel_enter_interrupt,
                options(noreturn),
            ) }
        }
    )*};
}

/// Declares the vector that drives the kernel's tick.
///
/// It counts down to the first timer: 36 cycles a tick with the interrupt's own 11, however many timers are
/// armed. Only when one is due does it become an interrupt like any other.
#[macro_export]
macro_rules! tick_interrupt {
    ($vector:ident) => {
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $vector() -> ! {
            // SAFETY: the hardware comes here, and `kernel_enter_interrupt` restores all that the handler may change.
            unsafe { core::arch::asm!(
                "push r31",               // 2
                "push r30",               // 2
                "in r30, 0x3f",           // 1: SREG
                "push r30",               // 2
                "lds r30, {left}",        // 2: Z = ticks until the first timer is due
                "lds r31, {left}+1",      // 2
                "sbiw r30, 1",            // 2
                "sts {left}, r30",        // 2
                "sts {left}+1, r31",      // 2
                "pop r30",                // 2: SREG, or what the interrupt must save of it
                "breq 1f",                // 1, or 2 when a timer is due
                "out 0x3f, r30",          // 1
                "pop r30",                // 2
                "pop r31",                // 2
                "reti",                   // 4
                "1:",
                "out 0x3f, r30",          // 1: as the interrupt found it
                "ldi r30, lo8(gs({handler}))", // 1
                "ldi r31, hi8(gs({handler}))", // 1
                "jmp {enter}",            // 3
                left = sym $crate::TICKS_LEFT,
                handler = sym $crate::expire,
                enter = sym $crate::arch::kernel_enter_interrupt,
                options(noreturn),
            ) }
        }
    };
}
