//! The classic AVR (ATmega128 datasheet, "AVR CPU Core").
//!
//! # Two kinds of context
//! A task that blocks does so at a place the compiler knows: [`switch`] tells it that every register is
//! lost there, and the compiler keeps what it needs, no more. So a *voluntary* context is the return address
//! and Y, which can't be declared lost: 4 bytes. An interrupt strikes anywhere: its *preempted* context is
//! all 32 registers, SREG and the program counter, 35 bytes. Bit 15 of the saved stack pointer, which no
//! SRAM address needs, tells which it is.
//!
//! The program counter takes 2 bytes, and 3 on an MCU with more than 128 KB of flash (ATmega2560): there each context
//! takes one more. Figures here are for 2. Addresses of functions are words in 16 bits everywhere: to those beyond
//! 128 KB the linker leads by a stub.
//!
//! ```text
//!   voluntary: r28 r29 PC
//!   preempted: PC r31 r30 r0 SREG r1 r18..r27 r28 r29 | r2..r17
//! ```
//!
//! # Interrupts
//! An interrupt pushes what a call may change and Y onto the stack it found (19 bytes with the PC), then moves
//! to the kernel's stack, so that handlers cost no task any stack, and calls the handler. Only if that made
//! a higher task ready are the other 16 registers saved, and that task's context is taken up instead. Handlers do not nest.
//!
//! A tick that ends a delay has entry, wake-up and switch in one piece.
//!
//! Those 16 registers are saved and loaded through a pointer, with SP on the idle task's stack and interrupts enabled: one
//! that strikes there lays nothing onto a task's stack. It finds that the head is not the running task, as it did before, but
//! sees by SP that it has struck the kernel, and leaves the switch to that.
//!
//! # Stacks
//! The kernel's stack is what `main` started on: the top of SRAM, growing down to the end of `.bss`. Its
//! first [`IDLE_STACK`] bytes are the idle task's, which has nothing to remember: it is begun anew each time. So its stack also
//! serves where the kernel has interrupts enabled: to save and load contexts, and for the expiry of timers.
//!
//! RAMPZ, on an MCU that has it, is part of a preempted context: its bit 0 lies in bit 7 of SREG, which every interrupt finds
//! clear. Where it has two bits (ATmega2560), that one tells whether any is set, and they lie in the upper half of the
//! program counter's third byte. A voluntary context does not keep it: set it anew after a call that may block.
//!
//! Cycle counts in the comments are those of the instruction beside them.

mod stand_in;
mod timers;
mod waits;

pub(crate) use timers::{arm, delay_until, disarm, disarm_within};
pub(crate) use waits::{enter_list, pull, push};

use core::arch::asm;
use core::mem::{MaybeUninit, offset_of, size_of};
use core::ops::Range;
use core::ptr;

use crate::context::Task;
use crate::group::{Group, StandIn};
use crate::masked::Masked;
use crate::paint::paint;
use crate::pool::{Pooled, Slot};
use crate::queue::{Appended, Queue};
use crate::semaphore::Semaphore;
use crate::task::{ControlBlock, Flag, Never};
use crate::timeout::Timeout;
use crate::timer::Timer;
use crate::{IDLE, KERNEL, Kernel};

/// Bytes of a return address. An MCU has `eijmp` if it needs 3.
const PROGRAM_COUNTER: usize = if cfg!(target_feature = "eijmpcall") { 3 } else { 2 };

/// Bytes that an interrupt pushes before it moves to the kernel's stack.
const FRAME: usize = 17 + PROGRAM_COUNTER;

/// Bytes at the top of the kernel's stack that are the idle task's: what an interrupt pushes, the expiry of timers, and what
/// another interrupt pushes that strikes that.
const IDLE_STACK: usize = 52 + 6 * PROGRAM_COUNTER;

/// The stack pointer of the idle task's control block: marked as preempted, which leads to where it begins anew.
pub(crate) const IDLE_CONTEXT: usize = 0x8000;

/// Offsets of what the assembly reads, in bytes.
const HEAD: usize = offset_of!(Kernel, ready.head);
#[doc(hidden)]
pub const RUNNING: usize = offset_of!(Kernel, ready.running);
const STACK_POINTER: usize = offset_of!(ControlBlock, stack_pointer);
const ARRIVED: usize = offset_of!(Kernel, ready.arrived);
const WALK: usize = offset_of!(Kernel, walk);
const LINK: usize = offset_of!(ControlBlock, link);
const LAST: usize = offset_of!(Kernel, ready.last);
const PRIORITY: usize = offset_of!(ControlBlock, priority);
const GROUPED_TASK: usize = offset_of!(Group, task);
const AWAITED: usize = offset_of!(StandIn, semaphore);
const FIRST_TIMER: usize = offset_of!(Kernel, timers.first);
const NEXT_DEADLINE: usize = offset_of!(Kernel, timers.next);
const DEADLINE: usize = offset_of!(Timer, deadline);
const TARGET: usize = offset_of!(Timer, target);
const _: () = assert!(offset_of!(ControlBlock, above) == 0);
const _: () = assert!(offset_of!(Timer, link) == 0);
const _: () = assert!(offset_of!(Group, last) == 0);
const _: () = assert!(offset_of!(StandIn, control) == 0);

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

/// Lets interrupts that are pending strike here, where they are masked. 3 cycles where none is.
#[inline(always)]
pub(crate) fn let_interrupts_strike() {
    // SAFETY: only `Expiry::mask` calls this, which stands for a stack that handlers leave alone.
    unsafe {
        asm!(
            "sei", // 1: takes effect after the next instruction
            "nop", // 1
            "cli", // 1
            options(nostack),
        )
    }
}

/// Has the compiler work `value` out here, and not in a masked section where it is used.
#[inline(always)]
pub(crate) fn worked_out(mut value: u8) -> u8 {
    // SAFETY: no instruction.
    unsafe { asm!("/* {0} */", inout(reg) value, options(nostack)) }
    value
}

/// The same of a reference.
#[inline(always)]
pub(crate) fn found<T>(place: &'static T) -> &'static T {
    let mut place = ptr::from_ref(place);
    // SAFETY: no instruction.
    unsafe { asm!("/* {0} */", inout(reg_pair) place, options(nostack)) }
    // SAFETY: it is what it was.
    unsafe { &*place }
}

/// Stands between two masked sections, or in a loop around one: behind `sei` interrupts strike only after another
/// instruction, so not at all if that is the `cli` of the next section. 1 cycle.
#[inline(always)]
pub(crate) fn part_sections() {
    // SAFETY: no effect.
    unsafe { asm!("nop", options(nostack)) }
}

/// The head, and the priorities above it. In X, where it needs no displacement, so that Z is left for another task.
#[inline(always)]
pub(crate) fn head_and_above(_: &Masked) -> (&'static ControlBlock, u8) {
    let (head, above): (*const ControlBlock, u8);
    // SAFETY: reads what `KERNEL.ready.head` points to; interrupts are masked.
    unsafe {
        asm!(
            "lds r26, {kernel}+{head}",   // 2
            "lds r27, {kernel}+{head}+1", // 2
            "ld {above}, X",              // 2: the first field of a control block
            kernel = sym KERNEL,
            head = const HEAD,
            above = out(reg) above,
            out("X") head,
            options(nostack, readonly, preserves_flags),
        );
    }
    // SAFETY: the head is a static, always.
    (unsafe { &*head }, above)
}

/// Makes `task` the head, from the register through which its link was written: 4 cycles.
#[inline(always)]
pub(crate) fn set_head(_: &Masked, task: &'static ControlBlock) {
    // SAFETY: writes `KERNEL.ready.head`, a static's address; interrupts are masked.
    unsafe {
        asm!(
            "sts {kernel}+{head}, r30",   // 2
            "sts {kernel}+{head}+1, r31", // 2
            kernel = sym KERNEL,
            head = const HEAD,
            in("Z") task,
            options(nostack, preserves_flags),
        );
    }
}

/// The head, the next task, and the priorities above that, in registers that they need not leave.
#[inline(always)]
pub(crate) fn head_and_next(_: &Masked) -> (&'static ControlBlock, &'static ControlBlock, u8) {
    let (head, next, above): (*const ControlBlock, *const ControlBlock, u8);
    // SAFETY: reads what `KERNEL.ready.head` points to, and its link, which leads on; interrupts are masked.
    unsafe {
        asm!(
            "lds r30, {kernel}+{head}",   // 2
            "lds r31, {kernel}+{head}+1", // 2
            "ldd r26, Z+{link}",          // 2
            "ldd r27, Z+{link}+1",        // 2
            "ld {above}, X",              // 2: the first field of a control block
            kernel = sym KERNEL,
            head = const HEAD,
            link = const LINK,
            above = out(reg) above,
            out("X") next,
            out("Z") head,
            options(nostack, readonly, preserves_flags),
        );
    }
    // SAFETY: both are statics, always: a ready task's link leads to another, at last to the idle task.
    (unsafe { &*head }, unsafe { &*next }, above)
}

/// A call of the kernel's assembly with Z = `$subject`, that changes what a call may. Returns whether another task is to run now.
/// If interrupts `$may_strike` they do so inside, where who waits stands in for a task.
macro_rules! call_to_wake {
    ($entry:ident, $subject:expr, $may_strike:expr) => {{
        let is_due: u8;
        asm!(
            "call {entry}", // 4
            entry = sym $entry,
            inout("Z") ptr::from_ref($subject) => _,
            inout("r21") $may_strike as u8 => _,
            out("r18") _, out("r19") _, out("r20") _, out("r22") _, out("r23") _, out("r24") is_due, out("r25") _,
            out("X") _,
        );
        core::hint::assert_unchecked(is_due <= 1);
        is_due != 0
    }};
}

/// [`Semaphore::signal`], by a call.
#[inline(always)]
pub(crate) fn signal(_: &Masked, semaphore: &Semaphore, may_strike: bool) -> bool {
    // SAFETY: interrupts are masked, and a semaphore's word and the lists become what they should.
    unsafe { call_to_wake!(kernel_signal, semaphore, may_strike) }
}

/// Makes `task` ready, which stands in for no other, by a call. Returns whether another task is to run now.
#[inline(always)]
pub(crate) fn make_ready(_: &Masked, task: &'static ControlBlock) -> bool {
    // SAFETY: interrupts are masked, and the lists become what they should.
    unsafe { call_to_wake!(kernel_make_ready, task, false) }
}

/// Puts `task`, which was woken and does not outrank the head, among those that have arrived, or does instead what is to be
/// done. Returns whether another task is to run now.
#[inline(always)]
pub(crate) fn arrive(_: &Masked, task: &'static ControlBlock, may_strike: bool) -> bool {
    // SAFETY: as above.
    unsafe { call_to_wake!(kernel_arrive, task, may_strike) }
}

/// Appends `slot` to `queue` if there is room, and stores its signal unless a task waits for it.
#[inline(always)]
pub(crate) fn append<T: Pooled>(_: &Masked, queue: &Queue<T>, slot: &'static Slot<T>) -> Appended {
    let appended: u8;
    // SAFETY: interrupts are masked, and the queue's fields become what they should.
    unsafe {
        asm!(
            "ldd r18, Z+{messages}+1",          // 2: the high byte of the semaphore's word
            "tst r18",                          // 1
            "breq 3f",                          // 2
            "brmi 2f",                          // 1
            "ldi r18, {awaited}",               // 1: tasks wait
            "rjmp 5f",                          // 2
            "2:",
            "std Z+{messages}, r1",             // 2: the last task that waited has left it empty
            "std Z+{messages}+1, r1",           // 2
            "clr r18",                          // 1
            "3:",
            "ldd r19, Z+{messages}",            // 2
            "ldd r20, Z+{room}",                // 2
            "cp r19, r20",                      // 1
            "brsh 4f",                          // 1
            "inc r19",                          // 1
            "std Z+{messages}, r19",            // 2
            "5:",
            "movw r26, {slot}",                 // 1: X = the message
            "st X+, r1",                        // 2: nothing behind it
            "st X, r1",                         // 2
            "ldd r20, Z+{first}+1",             // 2
            "tst r20",                          // 1
            "breq 6f",                          // 2
            "ldd r26, Z+{last}",                // 2: X = the last message
            "ldd r27, Z+{last}+1",              // 2
            "st X+, {slot:l}",                  // 2
            "st X, {slot:h}",                   // 2
            "rjmp 7f",                          // 2
            "4:",
            "ldi r18, {not}",                   // 1
            "rjmp 8f",                          // 2
            "6:",
            "std Z+{first}, {slot:l}",          // 2: it is the first, too
            "std Z+{first}+1, {slot:h}",        // 2
            "7:",
            "std Z+{last}, {slot:l}",           // 2
            "std Z+{last}+1, {slot:h}",         // 2
            "8:",
            slot = in(reg_pair) slot,
            in("Z") queue,
            out("r18") appended,
            out("r19") _,
            out("r20") _,
            out("X") _,
            first = const offset_of!(Queue<T>, first),
            last = const offset_of!(Queue<T>, last),
            messages = const offset_of!(Queue<T>, messages),
            room = const offset_of!(Queue<T>, room),
            awaited = const Appended::AWAITED.0,
            not = const Appended::NOT.0,
            options(nostack),
        );
    }
    Appended(appended)
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

/// Saves what a call may change beside r31, r30, r0 and SREG, and Y, which is left with SP: the handler preserves it. 29 cycles.
macro_rules! save_for_call {
    () => {
        concat!(
            "push r1\n",      // 2
            "clr r1\n",       // 1: compiled code counts on r1 = 0
            "push r18\n",     // 2: what a call may change, and Y
            "push r19\n",     // 2
            "push r20\n",     // 2
            "push r21\n",     // 2
            "push r22\n",     // 2
            "push r23\n",     // 2
            "push r24\n",     // 2
            "push r25\n",     // 2
            "push r26\n",     // 2
            "push r27\n",     // 2
            "push r28\n",     // 2
            "push r29\n",     // 2
            "in r28, 0x3d\n", // 1: Y = SP of the interrupted task; the handler preserves it
            "in r29, 0x3e\n", // 1
        )
    };
}

/// The context switch, with the other entries that share its instructions.
///
/// Not a naked function: rustc turns those into module-level assembly, which LLVM 22 checks against a bare
/// AVR1 (no `push`) when it writes the bitcode of a library. In a function without locals or clobbers the
/// compiler adds nothing but a `ret`, and a test of the image holds it to that.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".lowtext.kernel")]
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
            // Saves the running task's context and takes up the head's. Z is the running task's control block: its own.
            "push r28",                           // 2: Y, which the compiler needs and can't be told is lost
            "push r29",                           // 2
            ".global kernel_save",
            "kernel_save:",
            "in r24, 0x3d",                       // 1: r25:r24 = SP
            "in r25, 0x3e",                       // 1: its bit 15 is clear: voluntary
            "cli",                                // 1
            "std Z+{sp}, r24",                    // 2: its stack pointer
            "std Z+{sp}+1, r25",                  // 2
            // Takes up the context of the head. Interrupts are masked, and what ran is saved or not needed.
            "resume_head:",
            #[cfg(feature = "cpu-time")]
            "ldi r24, lo8(__stack)",              // 1: the idle task's stack, so that this costs no task any
            #[cfg(feature = "cpu-time")]
            "ldi r25, hi8(__stack)",              // 1
            #[cfg(feature = "cpu-time")]
            "out 0x3e, r25",                      // 1: SPH
            #[cfg(feature = "cpu-time")]
            "out 0x3d, r24",                      // 1: SPL
            #[cfg(feature = "cpu-time")]
            "call {charge}",                      // 4
            "lds r30, {kernel}+{head}",           // 2: Z = the head's control block
            "lds r31, {kernel}+{head}+1",         // 2
            #[cfg(feature = "fault-stale-head")]
            "resume:",
            "ldd r24, Z+{sp}",                    // 2: r25:r24 = its stack pointer
            "ldd r25, Z+{sp}+1",                  // 2
            "sbrc r25, 7",                        // 2: skips the next for a voluntary context
            "rjmp resume_preempted",              // 2
            "sts {kernel}+{running}, r30",        // 2: now it is the running one
            "sts {kernel}+{running}+1, r31",      // 2
            "out 0x3e, r25",                      // 1: SPH
            "sei",                                // 1: takes effect after the next instruction,
            "out 0x3d, r24",                      // 1: SPL: so the stack is whole before any interrupt
            "return_to_task:",
            "pop r29",                            // 2
            "pop r28",                            // 2
            "ret",                                // 4: to where the task has blocked
            // The idle task, with interrupts enabled.
            "idle:",
            #[cfg(feature = "tickless")]
            "cli",                                // 1
            #[cfg(feature = "tickless")]
            "call kernel_before_sleep",           // 4
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
            "movw r30, r24",                      // 1: Z = the lowest byte of the context
            "ld r17, Z",                          // 2
            "ldd r16, Z+1",                       // 2
            "ldd r15, Z+2",                       // 2
            "ldd r14, Z+3",                       // 2
            "ldd r13, Z+4",                       // 2
            "ldd r12, Z+5",                       // 2
            "ldd r11, Z+6",                       // 2
            "ldd r10, Z+7",                       // 2
            "ldd r9, Z+8",                        // 2
            "ldd r8, Z+9",                        // 2
            "ldd r7, Z+10",                       // 2
            "ldd r6, Z+11",                       // 2
            "ldd r5, Z+12",                       // 2
            "ldd r4, Z+13",                       // 2
            "ldd r3, Z+14",                       // 2
            "ldd r2, Z+15",                       // 2
            "adiw r24, 15",                       // 2: as if they had been popped
            "cli",                                // 1: an interrupt from here on would lay a context behind this one
            "lds r26, {kernel}+{head}",           // 2: the same as before: no interrupt struck
            "lds r27, {kernel}+{head}+1",         // 2
            "sts {kernel}+{running}, r26",        // 2
            "sts {kernel}+{running}+1, r27",      // 2
            "out 0x3e, r25",                      // 1: SPH
            "out 0x3d, r24",                      // 1: SPL
            // RAMPZ, which the context holds in bit 7 of SREG.
            #[cfg(target_feature = "elpm")]
            "ldd r25, Z+29",                      // 2: SREG
            #[cfg(target_feature = "elpm")]
            "sbrc r25, 7",                        // 2: skips the next where it is 0
            #[cfg(target_feature = "elpm")]
            "rjmp resume_rampz",                  // 2
            #[cfg(target_feature = "elpm")]
            "out 0x3b, r1",                       // 1: RAMPZ
            #[cfg(feature = "fault-early-enable")]
            "sei",
            "rjmp leave_interrupt",               // 2
            #[cfg(target_feature = "elpm")]
            "resume_rampz:",
            #[cfg(target_feature = "elpm")]
            "andi r25, 0x7f",                     // 1: SREG as `reti` wants it
            #[cfg(target_feature = "elpm")]
            "std Z+29, r25",                      // 2
            #[cfg(all(target_feature = "elpm", not(target_feature = "eijmpcall")))]
            "ldi r25, 1",                         // 1
            #[cfg(target_feature = "eijmpcall")]
            "ldd r24, Z+33",                      // 2: above the highest bits of PC
            #[cfg(target_feature = "eijmpcall")]
            "mov r25, r24",                       // 1
            #[cfg(target_feature = "eijmpcall")]
            "swap r25",                           // 1
            #[cfg(target_feature = "eijmpcall")]
            "andi r25, 0x0f",                     // 1
            #[cfg(target_feature = "eijmpcall")]
            "andi r24, 0x0f",                     // 1: PC as `reti` wants it
            #[cfg(target_feature = "eijmpcall")]
            "std Z+33, r24",                      // 2
            #[cfg(target_feature = "elpm")]
            "out 0x3b, r25",                      // 1: RAMPZ
            #[cfg(target_feature = "elpm")]
            "rjmp leave_interrupt",               // 2
            // Enters an interrupt: r31 and r30 are on the stack, Z is the handler's address in words.
            ".global kernel_enter_interrupt",
            "kernel_enter_interrupt:",
            "push r0",                            // 2
            "in r0, 0x3f",                        // 1: SREG; I is clear in it, `reti` sets it
            // The same from a vector that has done so much.
            ".global kernel_enter_with_status",
            "kernel_enter_with_status:",
            "push r0",                            // 2
            save_for_call!(),                     // 29
            "ldi r24, lo8(__stack - {idle})",     // 1: the kernel's stack, empty: handlers do not nest
            "ldi r25, hi8(__stack - {idle})",     // 1
            "out 0x3e, r25",                      // 1: SPH
            "out 0x3d, r24",                      // 1: SPL
            #[cfg(feature = "tickless")]
            "push r30",                           // 2
            #[cfg(feature = "tickless")]
            "push r31",                           // 2
            #[cfg(feature = "tickless")]
            "call kernel_after_sleep",            // 4
            #[cfg(feature = "tickless")]
            "pop r31",                            // 2
            #[cfg(feature = "tickless")]
            "pop r30",                            // 2
            "icall",                              // 3: the handler
            "exit_interrupt:",
            "lds r26, {kernel}+{head}",           // 2: X = the task that should run
            "lds r27, {kernel}+{head}+1",         // 2
            "lds r30, {kernel}+{running}",        // 2: Z = the task that does
            "lds r31, {kernel}+{running}+1",      // 2
            "cp r26, r30",                        // 1
            "cpc r27, r31",                       // 1
            "breq return_from_interrupt",         // 2, or 1 to switch
            // Saves the other half of a preempted context, with interrupts enabled: on the idle task's stack, and through Y.
            "preempt:",
            "cpi r29, hi8(__stack)",              // 1: where the interrupt struck on the kernel's own stack
            "breq to_struck_kernel",              // 1: there may be nothing to save
            "save:",
            "ldi r24, lo8(__stack)",              // 1: SPH is that of the kernel's stack already
            "out 0x3d, r24",                      // 1: SPL
            "save_half:",
            "sei",                                // 1
            "st Y, r2",                           // 2: at the free byte, and on down
            "st -Y, r3",                         // 2
            "st -Y, r4",                         // 2
            "st -Y, r5",                         // 2
            "st -Y, r6",                         // 2
            "st -Y, r7",                         // 2
            "st -Y, r8",                         // 2
            "st -Y, r9",                         // 2
            "st -Y, r10",                        // 2
            "st -Y, r11",                        // 2
            "st -Y, r12",                        // 2
            "st -Y, r13",                        // 2
            "st -Y, r14",                        // 2
            "st -Y, r15",                        // 2
            "st -Y, r16",                        // 2
            "st -Y, r17",                        // 2
            #[cfg(target_feature = "elpm")]
            "in r24, 0x3b",                       // 1: RAMPZ
            #[cfg(target_feature = "elpm")]
            "cpse r24, r1",                       // 2: skips the next where it is 0
            #[cfg(target_feature = "elpm")]
            "rjmp save_rampz",                    // 2
            "saved:",
            "ori r29, 0x80",                      // 1: preempted
            "std Z+{sp}, r28",                    // 2: its stack pointer
            "std Z+{sp}+1, r29",                  // 2
            "cli",                                // 1
            #[cfg(not(feature = "fault-stale-head"))]
            "rjmp resume_head",                   // 2: an interrupt may have changed it meanwhile, and back to the task saved here
            #[cfg(feature = "fault-stale-head")]
            "movw r30, r26",
            #[cfg(feature = "fault-stale-head")]
            "rjmp resume",
            "to_struck_kernel:",
            "rjmp struck_kernel",                 // 2: a branch does not reach so far
            // Leaves an interrupt to what it struck.
            "return_from_interrupt:",
            "out 0x3e, r29",                      // 1: SPH
            "out 0x3d, r28",                      // 1: SPL
            // Takes the rest of a preempted context off the stack.
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
            #[cfg(target_feature = "elpm")]
            "save_rampz:",
            #[cfg(target_feature = "eijmpcall")]
            "swap r24",                           // 1: its two bits above the highest of PC
            #[cfg(target_feature = "eijmpcall")]
            "ldd r25, Y+33",                      // 2
            #[cfg(target_feature = "eijmpcall")]
            "or r25, r24",                        // 1
            #[cfg(target_feature = "eijmpcall")]
            "std Y+33, r25",                      // 2
            #[cfg(target_feature = "elpm")]
            "ldd r24, Y+29",                      // 2: SREG
            #[cfg(target_feature = "elpm")]
            "ori r24, 0x80",                      // 1: bit 7, which is clear in every SREG that an interrupt saves
            #[cfg(target_feature = "elpm")]
            "std Y+29, r24",                      // 2
            #[cfg(target_feature = "elpm")]
            "rjmp saved",                         // 2
            // The interrupt struck in the page of the kernel's stack.
            "struck_kernel:",
            "cpi r28, lo8(__stack - {idle})",     // 1: or was it a task whose stack reaches there?
            "brsh 5f",                            // 2
            "rjmp save",                          // 2
            "5:",
            "cpi r28, lo8(__stack - {frame})",    // 1: the expiry of timers?
            "brne go_on",                         // 1: that goes on, and the switch comes at its end
            "ldi r24, hi8({idle_task})",          // 1
            "cpi r30, lo8({idle_task})",          // 1: the idle task?
            "cpc r31, r24",                       // 1
            "breq resume_other",                  // 1: it has nothing to go on with
            #[cfg(feature = "fault-stale-head")]
            "std Y+3, r27",                       // tells `save` of a new head, in its X
            #[cfg(feature = "fault-stale-head")]
            "std Y+4, r26",
            "go_on:",
            "rjmp return_from_interrupt",         // 2
            "resume_other:",
            "rjmp resume_head",                   // 2
            // The handler of a tick where idle is tickless.
            #[cfg(feature = "tickless")]
            ".global kernel_tickless",
            #[cfg(feature = "tickless")]
            "kernel_tickless:",
            #[cfg(feature = "tickless")]
            "call kernel_tick",                   // 4: r24 = whether a deadline is due
            #[cfg(feature = "tickless")]
            "tst r24",                            // 1
            #[cfg(feature = "tickless")]
            "brne kernel_expire",                 // 1, or 2
            #[cfg(feature = "tickless")]
            "ret",                                // 4
            // A tick struck in the page of the kernel's stack, and a timer is due.
            "expire_in_kernel:",
            "out 0x3e, r25",                      // 1: SPH
            "ldi r24, lo8(__stack - 1)",          // 1
            "cpi r28, lo8(__stack - {idle})",     // 1: `save`, or the idle task?
            "brlo 2f",                            // 1, or 2
            "mov r24, r28",                       // 1: below their context
            "2:",
            "rjmp expire_at",                     // 2
            // Enters the tick's interrupt where a timer is due: r31, r30 and r0 are on the stack, SREG is in r0.
            ".global kernel_enter_tick",
            "kernel_enter_tick:",
            "push r0",                            // 2
            save_for_call!(),                     // 29
            // A timer is due. It runs on the idle task's stack, so that handlers find their own empty. First the commonest
            // case, of a task whose delay is over and that outranks the one to run.
            ".global kernel_expire",
            "kernel_expire:",
            "ldi r24, lo8(__stack)",              // 1
            "ldi r25, hi8(__stack)",              // 1
            "cpi r29, hi8(__stack)",              // 1
            "breq expire_in_kernel",              // 1
            "out 0x3e, r25",                      // 1: SPH
            "out 0x3d, r24",                      // 1: SPL
            "lds r30, {kernel}+{timer}",          // 2: Z = the first timer
            "lds r31, {kernel}+{timer}+1",        // 2
            "tst r31",                            // 1
            "breq to_expire",                     // 1: there is none
            "ld r18, Z",                          // 2: r19:r18 = the next one
            "ldd r19, Z+1",                       // 2
            "ldd r24, Z+{target}",                // 2: what it wakes
            "ldd r25, Z+{target}+1",              // 2
            "sbrs r25, 7",                        // 2: skips the next for a task
            "to_expire:",
            "rjmp expire",                        // 2
            "andi r25, 0x7f",                     // 1
            "movw r30, r24",                      // 1: Z = the task
            "ldd r24, Z+{link}+1",                // 2
            "cpi r24, {delayed}",                 // 1
            "brne to_expire",                     // 1: its delay has not begun
            "lds r26, {kernel}+{head}",           // 2: X = the head
            "lds r27, {kernel}+{head}+1",         // 2
            "ld r24, X",                          // 2: the priorities above that
            "ld r25, Z",                          // 2: and above the task
            "cp r25, r24",                        // 1
            "brsh to_expire",                     // 1
            "std Z+{link}, r26",                  // 2: the task goes before the head
            "std Z+{link}+1, r27",                // 2
            "sts {kernel}+{head}, r30",           // 2
            "sts {kernel}+{head}+1, r31",         // 2
            "sts {kernel}+{timer}, r18",          // 2: and the timer from its list
            "sts {kernel}+{timer}+1, r19",        // 2
            "sts {kernel}+{walk}, r1",            // 2: ends a walk
            "sei",                                // 1: no task runs meanwhile, and interrupts leave timers alone
            "tst r19",                            // 1
            "cli",                                // 1: leaves the Z flag alone
            "breq expire",                        // 1: the last timer
            "movw r30, r18",                      // 1: Z = the next timer
            "ldd r24, Z+{deadline}",              // 2
            "ldd r25, Z+{deadline}+1",            // 2
            "lds r18, {kernel}+{next}",           // 2: the deadline that has come
            "lds r19, {kernel}+{next}+1",         // 2
            "sts {kernel}+{next}, r24",           // 2
            "sts {kernel}+{next}+1, r25",         // 2
            "sub r24, r18",                       // 1: ticks from that to the next
            "sbc r25, r19",                       // 1
            "lds r18, {left}",                    // 2: 0, or less if ticks have come meanwhile
            "lds r19, {left}+1",                  // 2
            "add r24, r18",                       // 1
            "adc r25, r19",                       // 1
            "sts {left}, r24",                    // 2
            "sts {left}+1, r25",                  // 2
            "cp r1, r24",                         // 1
            "cpc r1, r25",                        // 1
            "brge expire",                        // 1: it is due, too
            "lds r30, {kernel}+{running}",        // 2: Z = the running task
            "lds r31, {kernel}+{running}+1",      // 2
            "rjmp save_half",                     // 2
            // Whatever else: wakes one timer's task or posts its semaphore at a time, and lets interrupts strike in between. No task
            // runs meanwhile, and interrupts leave timers alone. Until no timer is due the ticks left are not positive, so that no
            // tick comes here as well.
            "expire:",
            "ldi r24, lo8(__stack - 1)",          // 1: not where `save` is struck
            "expire_at:",
            "out 0x3d, r24",                      // 1: SPL
            "3:",
            "sei",                                // 1
            "lds r30, {kernel}+{timer}",          // 2: Z = the first timer
            "lds r31, {kernel}+{timer}+1",        // 2
            "cli",                                // 1
            "tst r31",                            // 1
            "breq 5f",                            // 1: there is none
            "ld r18, Z",                          // 2
            "ldd r19, Z+1",                       // 2
            "ldd r24, Z+{target}",                // 2: r25:r24 = what it wakes
            "ldd r25, Z+{target}+1",              // 2
            "std Z+{target}, r1",                 // 2: it is not armed any more
            "std Z+{target}+1, r1",               // 2
            "sts {kernel}+{timer}, r18",          // 2
            "sts {kernel}+{timer}+1, r19",        // 2
            "sts {kernel}+{walk}, r1",            // 2: ends a walk
            "sei",                                // 1
            "movw r30, r24",                      // 1
            "cli",                                // 1
            "sbrs r25, 7",                        // 1, or 2: skips the next for a task
            "rjmp 6f",                            // 2
            "andi r31, 0x7f",                     // 1: Z = the task
            "ldd r24, Z+{link}+1",                // 2
            "cpi r24, {delayed}",                 // 1
            "brne 4f",                            // 1: its delay has not begun
            "rcall kernel_make_ready",            // 3
            "4:",
            "sei",                                // 1
            "lds r18, {kernel}+{timer}",          // 2: r19:r18 = the first timer
            "cli",                                // 1
            "5:",
            "lds r19, {kernel}+{timer}+1",        // 2
            "rcall kernel_count_down",            // 3
            "brge 3b",                            // 1, or 2: it is due, too
            "sei",                                // 1
            "nop",                                // 1
            "cli",                                // 1
            "rjmp exit_interrupt",                // 2
            // Posts a semaphore; or ends a wait, if it is the mark of a time-out.
            "6:",
            "ld r18, Z",                          // 2
            "ldd r19, Z+1",                       // 2
            "ldi r20, hi8({idle_task})",          // 1
            "cpi r18, lo8({idle_task})",          // 1
            "cpc r19, r20",                       // 1
            "breq 7f",                            // 1
            "sei",                                // 1
            "ldi r21, 1",                         // 1
            "cli",                                // 1
            "rcall kernel_signal",                // 3
            "rjmp 4b",                            // 2
            "7:",
            "rcall 8f",                           // 3
            "rjmp 4b",                            // 2
            ".weak kernel_elapse",                // of who waits with a time-out
            "8:",
            "jmp kernel_elapse",                  // 3
            // Ticks count down to the timer r19:r18, or a long while if r19 is 0. `brge` takes it for one that is not ahead.
            ".global kernel_count_down",
            "kernel_count_down:",
            "lds r20, {kernel}+{next}",           // 2: r21:r20 = the deadline before
            "lds r21, {kernel}+{next}+1",         // 2
            "movw r30, r18",                      // 1
            "tst r19",                            // 1
            "brne 1f",                            // 2, or 1
            "movw r18, r20",                      // 1
            "subi r18, lo8({earlier})",           // 1
            "sbci r19, hi8({earlier})",           // 1
            "rjmp 2f",                            // 2
            "1:",
            "ldd r18, Z+{deadline}",              // 2
            "ldd r19, Z+{deadline}+1",            // 2
            "2:",
            "sts {kernel}+{next}, r18",           // 2
            "sts {kernel}+{next}+1, r19",         // 2
            "sub r18, r20",                       // 1
            "sbc r19, r21",                       // 1
            "lds r20, {left}",                    // 2
            "lds r21, {left}+1",                  // 2
            "add r18, r20",                       // 1
            "adc r19, r21",                       // 1
            "sts {left}, r18",                    // 2
            "sts {left}+1, r19",                  // 2
            "cp r1, r18",                         // 1
            "cpc r1, r19",                        // 1
            "ret",                                // 4
            // The running task waits at the semaphore Z; in the commonest case there are neither signals nor other tasks, and none
            // has arrived that should run before the next. All registers but Y are lost.
            ".global kernel_wait",
            "kernel_wait:",
            "push r28",                           // 2: as for a switch
            "push r29",                           // 2
            "movw r24, r30",                      // 1: r25:r24 = the semaphore
            "cli",                                // 1
            "ldd r18, Z+1",                       // 2: the high byte of its word
            "tst r18",                            // 1
            "brmi 6f",                            // 2, or 1: it was left empty by who waited last
            "ld r19, Z",                          // 2
            "or r18, r19",                        // 1
            "brne 7f",                            // 1, or 2: there are signals, or tasks
            "6:",
            "lds r30, {kernel}+{head}",           // 2: Z = the running task
            "lds r31, {kernel}+{head}+1",         // 2
            "ldd r26, Z+{link}",                  // 2: X = the next one
            "ldd r27, Z+{link}+1",                // 2
            "ld r18, X",                          // 2: the priorities above that
            "lds r19, {kernel}+{arrived}",        // 2: those at which tasks have arrived
            "and r18, r19",                       // 1
            "brne 7f",                            // 1
            "sts {kernel}+{head}, r26",           // 2: the next one is the head
            "sts {kernel}+{head}+1, r27",         // 2
            "sts {kernel}+{walk}, r1",            // 2: ends a walk
            "movw r26, r24",                      // 1: X = the semaphore
            "ori r25, {end}",                     // 1: the end of its list
            "std Z+{link}, r24",                  // 2: is the task's link,
            "std Z+{link}+1, r25",                // 2
            "st X+, r30",                         // 2: and its beginning is the task
            "st X, r31",                          // 2
            "sei",                                // 1: a trap finds the task that has blocked still running
            "rjmp kernel_save",                   // 2
            "7:",
            "sei",                                // 1
            "lds r28, {kernel}+{running}",        // 2: Y = the running task
            "lds r29, {kernel}+{running}+1",      // 2
            "clr r21",                            // 1: nothing else ends the wait
            "call {enter}",                       // 4: r24 = whether it has not blocked
            "movw r30, r28",                      // 1
            "cpse r24, r1",                       // 1, or 2 where it has
            "rjmp return_to_task",                // 2
            "rjmp kernel_save",                   // 2
            // Lets the first task that has arrived at the running one's priority run. All registers but Y are lost.
            ".global kernel_yield",
            "kernel_yield:",
            "lds r30, {kernel}+{running}",        // 2: Z = the running task
            "lds r31, {kernel}+{running}+1",      // 2
            "rcall queue_of",                     // 3: X = where the last of its priority is
            "cli",                                // 1
            "ld r18, X+",                         // 2
            "ld r19, X",                          // 2
            "tst r19",                            // 1
            "breq 1f",                            // 1: there is none
            "st X, r31",                          // 2: that is the task now
            "st -X, r30",                         // 2
            "movw r26, r18",                      // 1
            "adiw r26, {link}",                   // 2: X = the link of the last before
            "ld r20, X+",                         // 2: r21:r20 = the first
            "ld r21, X",                          // 2
            "st X, r31",                          // 2: the task is behind that
            "st -X, r30",                         // 2
            "movw r26, r20",                      // 1
            "adiw r26, {link}",                   // 2: X = the link of the first: to the task, if it was alone
            "ld r18, X",                          // 2
            "ldd r19, Z+{link}",                  // 2
            "st X+, r19",                         // 2: the first is before the rest of the list
            "ld r19, X",                          // 2
            "ldd r22, Z+{link}+1",                // 2
            "st X, r22",                          // 2
            "std Z+{link}, r18",                  // 2: the task is before the second
            "std Z+{link}+1, r19",                // 2
            "sts {kernel}+{head}, r20",           // 2
            "sts {kernel}+{head}+1, r21",         // 2
            "sei",                                // 1
            "rjmp kernel_switch",                  // 2
            // X = where the last is of those that have arrived at the priority of the task Z.
            ".global kernel_queue_of",
            "kernel_queue_of:",
            "queue_of:",
            "ldd r26, Z+{priority}",              // 2
            "andi r26, 7",                        // 1
            "lsl r26",                            // 1
            "clr r27",                            // 1
            "subi r26, lo8(-({kernel}+{last}))",  // 1
            "sbci r27, hi8(-({kernel}+{last}))",  // 1
            "ret",                                // 4
            "1:",
            "sei",                                // 1
            "ret",                                // 4
            // A task signals the semaphore Z. It preserves what a call does.
            ".global kernel_post",
            "kernel_post:",
            #[cfg(not(feature = "fault-unmasked-post"))]
            "cli",                                // 1
            "ldd r25, Z+1",                       // 2: the high byte of its word
            "tst r25",                            // 1
            "brne 1f",                            // 1: tasks wait, or the last has left it empty
            "ld r24, Z",                          // 2
            "inc r24",                            // 1
            "breq 2f",                            // 1: no more go in
            "st Z, r24",                          // 2
            "2:",
            "reti",                               // 4: and interrupts are enabled
            "1:",
            "ldi r21, 1",                         // 1
            "rcall kernel_signal",                // 3
            "sei",                                // 1
            "sbrs r24, 0",                        // 1, or 2: is another task to run?
            "ret",                                // 4
            // A switch from where it seldom comes to one: saves what a call preserves.
            ".global kernel_switch_from_call",
            "kernel_switch_from_call:",
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
            "lds r30, {kernel}+{running}",        // 2: Z = the running task
            "lds r31, {kernel}+{running}+1",      // 2
            "rcall kernel_switch",                 // 3
            "pop r17",                            // 2
            "pop r16",                            // 2
            "pop r15",                            // 2
            "pop r14",                            // 2
            "pop r13",                            // 2
            "pop r12",                            // 2
            "pop r11",                            // 2
            "pop r10",                            // 2
            "pop r9",                             // 2
            "pop r8",                             // 2
            "pop r7",                             // 2
            "pop r6",                             // 2
            "pop r5",                             // 2
            "pop r4",                             // 2
            "pop r3",                             // 2
            "pop r2",                             // 2
            "ret",                                // 4
            // Signals the semaphore Z, with interrupts masked. r24 = whether another task is to run now. What else a call may
            // change is changed. r21 is 0 unless interrupts may strike in between.
            ".global kernel_signal",
            "kernel_signal:",
            "movw r26, r30",                      // 1: X = the semaphore
            "ld r18, X+",                         // 2: its word
            "ld r19, X",                          // 2
            "cp r1, r19",                         // 1
            "brge kernel_store_signal",           // 1
            "movw r30, r18",                      // 1: Z = the first task that waits
            "ldd r18, Z+{link}",                  // 2
            "ldd r19, Z+{link}+1",                // 2
            "st X, r19",                          // 2: the next one is the first now
            "st -X, r18",                         // 2
            "ld r25, Z",                          // 2: the priorities above the task
            "lds r26, {kernel}+{head}",           // 2: X = the head
            "lds r27, {kernel}+{head}+1",         // 2
            "ld r24, X",                          // 2: the priorities above that
            "cp r25, r24",                        // 1
            "brsh arrive_or_stand",               // 1, or 2
            "preempt_head:",
            "std Z+{link}, r26",                  // 2: the task goes before the head
            "std Z+{link}+1, r27",                // 2
            "sts {kernel}+{head}, r30",           // 2
            "sts {kernel}+{head}+1, r31",         // 2
            "ldi r24, 1",                         // 1
            "ret",                                // 4
            // Makes the task Z ready, that stands in for no other. r24 as above.
            ".global kernel_make_ready",
            "kernel_make_ready:",
            "ld r25, Z",                          // 2
            "cpi r25, {suspended}",               // 1
            "breq park",                          // 1
            "lds r26, {kernel}+{head}",           // 2: as above
            "lds r27, {kernel}+{head}+1",         // 2
            "ld r24, X",                          // 2
            "cp r25, r24",                        // 1
            "brlo preempt_head",                  // 1, or 2
            "rjmp arrive",                        // 2
            // It is suspended, and left until it is resumed.
            "park:",
            "ldi r24, lo8({parked})",             // 1
            "ldi r25, hi8({parked})",             // 1
            "std Z+{link}, r24",                  // 2
            "std Z+{link}+1, r25",                // 2
            "clr r24",                            // 1
            "ret",                                // 4
            ".global kernel_store_signal",
            "kernel_store_signal:",
            "breq 1f",                            // 2, or 1 where the last task that waited has left it empty
            "clr r18",                            // 1
            "1:",
            "inc r18",                            // 1
            "breq 2f",                            // 1: no more go in
            "st X, r1",                           // 2
            "st -X, r18",                         // 2
            "2:",
            "clr r24",                            // 1
            "ret",                                // 4
            // The task Z, first of those that waited, does not outrank the head.
            ".global kernel_arrive",
            "kernel_arrive:",
            "ld r25, Z",                          // 2
            "arrive_or_stand:",
            "cpi r25, {suspended}",               // 1
            "breq suspended",                     // 1
            // It joins those that have arrived at its priority.
            "arrive:",
            "ldd r26, Z+{priority}",              // 2
            "andi r26, 7",                        // 1
            "lsl r26",                            // 1
            "clr r27",                            // 1
            "subi r26, lo8(-({kernel}+{last}))",  // 1: X = where its last is
            "sbci r27, hi8(-({kernel}+{last}))",  // 1
            "ld r18, X+",                         // 2
            "ld r19, X",                          // 2
            "st X, r31",                          // 2: that is the task now
            "st -X, r30",                         // 2
            "tst r19",                            // 1
            "breq 1f",                            // 1: there was none
            "movw r26, r30",                      // 1: X = the task
            "movw r30, r18",                      // 1: Z = the one before
            "ldd r18, Z+{link}",                  // 2: it leads to the first, and the task will
            "ldd r19, Z+{link}+1",                // 2
            "std Z+{link}, r26",                  // 2
            "std Z+{link}+1, r27",                // 2
            "adiw r26, {link}",                   // 2
            "st X+, r18",                         // 2
            "st X, r19",                          // 2
            "clr r24",                            // 1
            "ret",                                // 4
            "1:",
            "std Z+{link}, r30",                  // 2: a ring of one
            "std Z+{link}+1, r31",                // 2
            "inc r25",                            // 1: its bit in a set of priorities
            "lds r24, {kernel}+{arrived}",        // 2
            "or r24, r25",                        // 1
            "sts {kernel}+{arrived}, r24",        // 2
            "clr r24",                            // 1
            "ret",                                // 4
            "suspended:",
            "ldd r25, Z+{priority}",              // 2
            "sbrs r25, {stands_in}",              // 2, or 1
            "rjmp park",                          // 2
            // It stands in for another task, in a program where one waits for several semaphores.
            ".weak kernel_stand_in",
            "jmp kernel_stand_in",                // 3
            // Where a task starts: Y is its body and its entry lies on the stack, laid there by `prepare`.
            "kernel_start_task:",
            "movw r24, r28",                      // 1: the first argument
            "pop r30",                            // 2
            "pop r31",                            // 2
            "ijmp",                               // 2
            // The start: the idle task is the running one, and `main`'s stack is not needed any more.
            ".global kernel_run",
            "kernel_run:",
            "rjmp resume_head",                   // 2
            sp = const STACK_POINTER,
            #[cfg(feature = "cpu-time")]
            charge = sym crate::cpu_time::charge_before_switch,
            earlier = const crate::timer::LONGEST.wrapping_neg(),
            left = sym crate::TICKS_LEFT,
            timer = const FIRST_TIMER,
            next = const NEXT_DEADLINE,
            deadline = const DEADLINE,
            target = const TARGET,
            delayed = const (crate::link::DELAYED >> 8),
            enter = sym waits::kernel_enter_list,
            suspended = const crate::task::SUSPENDED,
            stands_in = const (Flag::StandsIn as u8).trailing_zeros(),
            parked = const crate::link::PARKED,
            last = const LAST,
            priority = const PRIORITY,
            link = const LINK,
            arrived = const ARRIVED,
            walk = const WALK,
            end = const (crate::link::END >> 8),
            kernel = sym KERNEL,
            idle_task = sym IDLE,
            head = const HEAD,
            running = const RUNNING,
            frame = const FRAME,
            idle = const IDLE_STACK,
        )
    }
}

unsafe extern "C" {
    fn kernel_start_task();
    fn kernel_run() -> !;
    fn kernel_signal();
    fn kernel_make_ready();
    fn kernel_arrive();
    fn kernel_wait();
    fn kernel_yield();
    fn kernel_post();
    fn kernel_switch_from_call();
    #[doc(hidden)]
    pub fn kernel_enter_interrupt();
    #[doc(hidden)]
    pub fn kernel_enter_with_status();
    #[doc(hidden)]
    pub fn kernel_enter_tick();
}

/// A call after which every register but Y is lost. So a function that inlines this saves what it must preserve: right for the
/// loop of a task, which must preserve nothing.
macro_rules! call_that_loses_all {
    ($entry:ident, $subject:expr) => {
        asm!(
            "call {entry}", // 4
            entry = sym $entry,
            inout("Z") $subject => _,
            out("r2") _, out("r3") _, out("r4") _, out("r5") _, out("r6") _, out("r7") _,
            out("r8") _, out("r9") _, out("r10") _, out("r11") _, out("r12") _, out("r13") _,
            out("r14") _, out("r15") _, out("r16") _, out("r17") _, out("r18") _, out("r19") _,
            out("r20") _, out("r21") _, out("r22") _, out("r23") _, out("r24") _, out("r25") _,
            out("r26") _, out("r27") _,
        )
    };
}

/// Takes a signal of `semaphore`, and blocks until there is one. 64 cycles to a task that blocked likewise, where none else waits.
#[inline(always)]
pub(crate) fn wait(semaphore: &Semaphore, _: &mut Task) {
    // SAFETY: a task calls this, with interrupts enabled. All that changes meanwhile is declared.
    unsafe { call_that_loses_all!(kernel_wait, ptr::from_ref(semaphore)) }
}

/// Lets tasks of the same priority that are ready run first.
#[inline(always)]
pub(crate) fn yield_now(_: &mut Task) {
    // SAFETY: as above.
    unsafe { call_that_loses_all!(kernel_yield, MaybeUninit::<u16>::uninit()) }
}

/// Saves the running task's context and takes up the head's; returns when this task runs again. It is a call, and preserves
/// what one does.
///
/// 120 cycles to a task that blocked likewise. If an interrupt has made the switch first, this one is to the task itself, and
/// comes back at once.
#[inline(always)]
pub(crate) fn switch_from_call() {
    // SAFETY: a task calls this, with interrupts enabled. It is a call.
    unsafe { kernel_switch_from_call() }
}

/// Tells the linker of what wakes a task by those that stand in for it, which a program where none does has not.
#[inline(always)]
pub(crate) fn name_stand_in() {
    // SAFETY: no instruction.
    unsafe {
        asm!(
            ".weak kernel_stand_in",
            ".ifndef kernel_stand_in", // here and there
            ".set kernel_stand_in, {wake}",
            ".endif",
            wake = sym stand_in::kernel_wake_stand_in,
            options(nomem, nostack, preserves_flags),
        )
    }
}

/// Tells the linker of [`Timeout::elapse`], which a program without time-outs does not have.
#[inline(always)]
pub(crate) fn name_elapse() {
    // SAFETY: no instruction.
    unsafe {
        asm!(
            ".weak kernel_elapse",
            ".ifndef kernel_elapse",
            ".set kernel_elapse, {elapse}",
            ".endif",
            elapse = sym Timeout::elapse,
            options(nomem, nostack, preserves_flags),
        )
    }
}

/// [`Semaphore::signal`] by a task, and a switch if one is due.
#[inline(always)]
pub(crate) fn post(semaphore: &Semaphore, _: &mut Task) {
    // SAFETY: a task calls this, with interrupts enabled; and what a call may change is declared.
    unsafe {
        asm!(
            "call {post}", // 4
            post = sym kernel_post,
            inout("Z") ptr::from_ref(semaphore) => _,
            out("r18") _, out("r19") _, out("r20") _, out("r21") _, out("r22") _, out("r23") _, out("r24") _, out("r25") _,
            out("X") _,
        )
    }
}

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

#[cfg(feature = "cpu-time")]
unsafe extern "C" {
    /// Lies where the counter of the clock is: see [`clock_interrupts!`](crate::clock_interrupts!).
    static kernel_clock: [u8; 2];
}

/// What the clock of tasks' times says.
#[cfg(feature = "cpu-time")]
#[inline(always)]
pub(crate) fn clock(_: &Masked) -> u16 {
    let low = (&raw const kernel_clock).cast::<u8>();
    // SAFETY: a register of two bytes. Reading the low one keeps the high one as it was then (ATmega128 datasheet, "Accessing
    // 16-bit Registers"), and interrupts are masked.
    u16::from_le_bytes(unsafe { [low.read_volatile(), low.add(1).read_volatile()] })
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
        #[unsafe(link_section = ".lowtext.kernel")]
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
                "rjmp {enter}",           // 2: `.lowtext` holds the kernel's entry, too
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
        #[unsafe(link_section = ".lowtext.kernel")]
        unsafe extern "C" fn $vector() -> ! {
            // SAFETY: the hardware comes here, and `kernel_enter_interrupt` restores all that the handler may change.
            unsafe { core::arch::asm!(
                "push r31",               // 2
                "push r30",               // 2
                "push r0",                // 2
                "in r0, 0x3f",            // 1: SREG
                "lds r30, {left}",        // 2: Z = ticks until the first timer is due
                "lds r31, {left}+1",      // 2
                "sbiw r30, 1",            // 2
                "sts {left}, r30",        // 2
                "sts {left}+1, r31",      // 2
                "breq 1f",                // 1, or 2 when a timer is due
                "out 0x3f, r0",           // 1
                "pop r0",                 // 2
                "pop r30",                // 2
                "pop r31",                // 2
                "reti",                   // 4
                "1:",
                "rjmp {enter}",           // 2
                left = sym $crate::TICKS_LEFT,
                enter = sym $crate::arch::kernel_enter_tick,
                options(noreturn),
            ) }
        }
    };
}

/// Declares the clock of tasks' times, for the feature `cpu-time`: the address of a 16-bit counter that runs through all its
/// values, and two vectors that come half a turn apart. With one a turn, a whole turn might pass between two readings.
///
/// ```ignore
/// kernel::clock_interrupts!(0x88, __vector_26, __vector_29);
/// ```
#[cfg(feature = "cpu-time")]
#[macro_export]
macro_rules! clock_interrupts {
    ($counter:literal, $one:ident, $other:ident) => {
        core::arch::global_asm!(".global kernel_clock", concat!(".set kernel_clock, ", $counter),);
        $crate::interrupt! {
            fn $one(interrupt) { $crate::charge_in_turn(interrupt) }
            fn $other(interrupt) { $crate::charge_in_turn(interrupt) }
        }
    };
}

/// Declares the vector that drives the kernel's tick where idle is tickless, for the feature `tickless`: that of the compare
/// unit of a [`TickTimer`](crate::tickless::TickTimer). It takes the place of [`tick_interrupt!`](crate::tick_interrupt!).
#[cfg(feature = "tickless")]
#[macro_export]
macro_rules! tickless_interrupt {
    ($vector:ident, $timer:ty) => {
        #[unsafe(no_mangle)]
        extern "C" fn kernel_before_sleep() {
            $crate::tickless::before_sleep::<$timer>();
        }
        #[unsafe(no_mangle)]
        extern "C" fn kernel_after_sleep() {
            $crate::tickless::after_sleep::<$timer>();
        }
        #[unsafe(no_mangle)]
        extern "C" fn kernel_tick() -> bool {
            $crate::tickless::tick::<$timer>()
        }
        #[unsafe(no_mangle)]
        #[unsafe(link_section = ".lowtext.kernel")]
        unsafe extern "C" fn $vector() -> ! {
            // SAFETY: the hardware comes here, and `kernel_enter_interrupt` restores all that the handler may change.
            unsafe { core::arch::asm!(
                "push r31",               // 2
                "push r30",               // 2
                "ldi r30, lo8(gs(kernel_tickless))", // 1: Z = the handler, in words
                "ldi r31, hi8(gs(kernel_tickless))", // 1
                "rjmp {enter}",           // 2
                enter = sym $crate::arch::kernel_enter_interrupt,
                options(noreturn),
            ) }
        }
    };
}

/// Declares the vector of the trap, for [`TaskHandle::step`](crate::TaskHandle::step): an interrupt that stays pending until the
/// block disables it, and goes before all others that are enabled meanwhile.
///
/// ```ignore
/// kernel::trap_interrupt! { fn __vector_9(interrupt) { disable_the_trap(interrupt) } }
/// ```
#[macro_export]
macro_rules! trap_interrupt {
    (fn $vector:ident($interrupt:ident) $body:block) => {
        #[unsafe(no_mangle)]
        #[unsafe(link_section = ".lowtext.kernel")]
        unsafe extern "C" fn $vector() -> ! {
            extern "C" fn handler() {
                // SAFETY: only the vector calls this, with interrupts masked.
                let $interrupt = &mut unsafe { $crate::Interrupt::assume() };
                if $crate::stepped($interrupt) {
                    $body
                }
            }
            // SAFETY: the hardware comes here, and either nothing is changed, or `kernel_enter_interrupt` restores all.
            unsafe { core::arch::asm!(
                "push r31",               // 2
                "push r30",               // 2
                "push r0",                // 2
                "in r0, 0x3f",            // 1: SREG
                "lds r30, {stepped}",     // 2: the low byte of the task that is to make a step
                "lds r31, {kernel}+{running}", // 2: and of the one that runs
                "cp r30, r31",            // 1
                "brne 1f",                // 1, or 2
                "lds r30, {stepped}+1",   // 2: the high bytes
                "lds r31, {kernel}+{running}+1", // 2
                "cp r30, r31",            // 1
                "brne 1f",                // 1, or 2
                "out 0x3f, r0",           // 1
                "pop r0",                 // 2
                "ldi r30, lo8(gs({handler}))", // 1: Z = the handler, in words
                "ldi r31, hi8(gs({handler}))", // 1
                "rjmp {enter}",           // 2
                "1:",
                "out 0x3f, r0",           // 1
                "pop r0",                 // 2
                "pop r30",                // 2
                "pop r31",                // 2
                "reti",                   // 4: and one instruction of what was struck
                handler = sym handler,
                stepped = sym $crate::STEPPED,
                kernel = sym $crate::KERNEL,
                running = const $crate::arch::RUNNING,
                enter = sym $crate::arch::kernel_enter_interrupt,
                options(noreturn),
            ) }
        }
    };
}
