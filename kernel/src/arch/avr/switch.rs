//! The context switch: entry and exit of interrupts, saving and resuming of contexts, and idling. Its only
//! decision is whether the head is the running task.

use core::arch::asm;
use core::mem::offset_of;

use super::FRAME;
use crate::context::Task;
use crate::control_block::ControlBlock;
use crate::{IDLE, KERNEL, Kernel};

/// Offsets of what the assembly reads, in bytes.
const HEAD: usize = offset_of!(Kernel, ready.head);
#[doc(hidden)]
pub const RUNNING: usize = offset_of!(Kernel, ready.running);
const STACK_POINTER: usize = offset_of!(ControlBlock, stack_pointer);

unsafe extern "C" {
    /// Resumes the head, with interrupts masked. The context of what ran must not be needed any more.
    pub(super) fn kernel_run_head() -> !;
    #[doc(hidden)]
    pub fn kernel_enter_interrupt();
    #[doc(hidden)]
    pub fn kernel_enter_with_status();
}

/// Saves the running task's context and resumes the head's; returns when the task runs again. 45 cycles to a
/// task that has switched this way, too. If an ISR has made the switch already, this one is from the task to
/// itself, and returns at once.
///
/// Clobbers every register but Y, so a function that inlines this saves all those that it must preserve. That
/// suits the loop of a task, which has no caller to preserve them for.
#[inline(always)]
pub(crate) fn switch(_: &mut Task) {
    // SAFETY: a task calls this, with interrupts enabled. All registers that change meanwhile are declared.
    unsafe {
        asm!(
            "call {switch}", // 4
            switch = sym kernel_switch,
            out("r2") _, out("r3") _, out("r4") _, out("r5") _, out("r6") _, out("r7") _,
            out("r8") _, out("r9") _, out("r10") _, out("r11") _, out("r12") _, out("r13") _,
            out("r14") _, out("r15") _, out("r16") _, out("r17") _, out("r18") _, out("r19") _,
            out("r20") _, out("r21") _, out("r22") _, out("r23") _, out("r24") _, out("r25") _,
            out("r26") _, out("r27") _, out("r30") _, out("r31") _,
        )
    }
}

/// [`switch`] as a function call, which preserves the registers that a call preserves: 72 cycles more where
/// it is called, none where it is not.
#[inline(never)]
pub(crate) fn switch_from_call(task: &mut Task) {
    switch(task);
}

/// The context switch, with the other entries that share its instructions.
///
/// Not a naked function: rustc turns those into module-level assembly, which LLVM 22 checks against a bare
/// AVR1 (no `push`) when it writes the bitcode of a library. In a function without locals or clobbers the
/// compiler adds nothing; a test of the image checks that.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".lowtext.kernel")]
#[inline(never)]
#[expect(
    named_asm_labels,
    reason = "other code jumps to them, and a function that is not inlined stands once"
)]
unsafe extern "C" fn kernel_switch() -> ! {
    // SAFETY: a task calls this, with interrupts enabled. When the task runs again it returns as a call
    // would, with Y and the stack as they were; `switch` declares the other registers.
    unsafe {
        asm!(
            // Saves the running task's voluntary context.
            "push r28",                           // 2: Y, which can't be declared as clobbered
            "push r29",                           // 2
            "lds r30, {kernel}+{running}",        // 2: Z = the running task's control block
            "lds r31, {kernel}+{running}+1",      // 2
            "in r24, 0x3d",                       // 1: r25:r24 = SP
            "in r25, 0x3e",                       // 1: its bit 15 is clear: voluntary
            "cli",                                // 1
            "std Z+{sp}, r24",                    // 2: its stack pointer
            "std Z+{sp}+1, r25",                  // 2
            "rjmp kernel_run_head",               // 2
            // Saves the other half of a preempted context, with interrupts enabled: the kernel's stack is
            // empty, and Y leads to the task's.
            "save:",
            #[cfg(feature = "fault-stale-head")]
            "lds r26, {kernel}+{head}",
            #[cfg(feature = "fault-stale-head")]
            "lds r27, {kernel}+{head}+1",
            "sei",                                // 1
            "st Y, r2",                           // 2: at the free byte, and on down
            "st -Y, r3",                          // 2
            "st -Y, r4",                          // 2
            "st -Y, r5",                          // 2
            "st -Y, r6",                          // 2
            "st -Y, r7",                          // 2
            "st -Y, r8",                          // 2
            "st -Y, r9",                          // 2
            "st -Y, r10",                         // 2
            "st -Y, r11",                         // 2
            "st -Y, r12",                         // 2
            "st -Y, r13",                         // 2
            "st -Y, r14",                         // 2
            "st -Y, r15",                         // 2
            "st -Y, r16",                         // 2
            "st -Y, r17",                         // 2
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
            #[cfg(feature = "fault-stale-head")]
            "movw r30, r26",
            #[cfg(feature = "fault-stale-head")]
            "rjmp resume",
            // Resumes the context of the head. Interrupts are masked, and what ran is saved or not needed.
            ".global kernel_run_head",
            "kernel_run_head:",
            #[cfg(any(feature = "cpu-time", feature = "stack-check"))]
            "ldi r24, lo8(__stack)",              // 1: the kernel's stack, so that this costs no task any
            #[cfg(any(feature = "cpu-time", feature = "stack-check"))]
            "ldi r25, hi8(__stack)",              // 1
            #[cfg(any(feature = "cpu-time", feature = "stack-check"))]
            "out 0x3e, r25",                      // 1: SPH
            #[cfg(any(feature = "cpu-time", feature = "stack-check"))]
            "out 0x3d, r24",                      // 1: SPL
            #[cfg(feature = "stack-check")]
            "call {check}",                       // 4
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
            // Loads half of a preempted context as the idle task: at the top of the kernel's stack, with
            // interrupts enabled. An interrupt that occurs here finds the idle task running, and restarts the
            // load with the head.
            "resume_preempted:",
            "ldi r18, lo8({idle_task})",          // 1
            "ldi r19, hi8({idle_task})",          // 1
            "sts {kernel}+{running}, r18",        // 2
            "sts {kernel}+{running}+1, r19",      // 2
            "ldi r18, lo8(__stack)",              // 1: the kernel's stack, empty
            "ldi r19, hi8(__stack)",              // 1
            "out 0x3e, r19",                      // 1: SPH
            "sei",                                // 1
            "out 0x3d, r18",                      // 1: SPL
            "andi r25, 0x7f",                     // 1: the stack pointer without its mark
            "breq idle",                          // 1: the idle task has none
            "movw r22, r30",                      // 1: r23:r22 = the head
            "movw r30, r24",                      // 1: Z = the lowest byte of the context
            "ld r17, Z+",                         // 2: and on up
            "ld r16, Z+",                         // 2
            "ld r15, Z+",                         // 2
            "ld r14, Z+",                         // 2
            "ld r13, Z+",                         // 2
            "ld r12, Z+",                         // 2
            "ld r11, Z+",                         // 2
            "ld r10, Z+",                         // 2
            "ld r9, Z+",                          // 2
            "ld r8, Z+",                          // 2
            "ld r7, Z+",                          // 2
            "ld r6, Z+",                          // 2
            "ld r5, Z+",                          // 2
            "ld r4, Z+",                          // 2
            "ld r3, Z+",                          // 2
            "ld r2, Z",                           // 2: Z = the free byte below what `pop` takes next
            "cli",                                // 1: an interrupt from here on would lay a context behind this one
            "sts {kernel}+{running}, r22",        // 2
            "sts {kernel}+{running}+1, r23",      // 2
            "out 0x3e, r31",                      // 1: SPH
            "out 0x3d, r30",                      // 1: SPL
            // RAMPZ, which the context holds in bit 7 of SREG.
            #[cfg(target_feature = "elpm")]
            "ldd r25, Z+14",                      // 2: SREG
            #[cfg(all(target_feature = "elpm", not(target_feature = "eijmpcall")))]
            "clr r24",                            // 1
            #[cfg(all(target_feature = "elpm", not(target_feature = "eijmpcall")))]
            "lsl r25",                            // 1: carry = RAMPZ
            #[cfg(all(target_feature = "elpm", not(target_feature = "eijmpcall")))]
            "rol r24",                            // 1
            #[cfg(all(target_feature = "elpm", not(target_feature = "eijmpcall")))]
            "lsr r25",                            // 1: SREG without I, which `sei` sets
            #[cfg(target_feature = "eijmpcall")]
            "clr r18",                            // 1
            #[cfg(target_feature = "eijmpcall")]
            "bst r25, 7",                         // 1: is any of its bits set?
            #[cfg(target_feature = "eijmpcall")]
            "brtc 1f",                            // 1, or 2
            #[cfg(target_feature = "eijmpcall")]
            "andi r25, 0x7f",                     // 1: SREG without I, which `sei` sets
            #[cfg(target_feature = "eijmpcall")]
            "ldd r18, Z+18",                      // 2: above the highest bits of PC
            #[cfg(target_feature = "eijmpcall")]
            "mov r24, r18",                       // 1
            #[cfg(target_feature = "eijmpcall")]
            "andi r24, 0x0f",                     // 1: PC as `ret` wants it
            #[cfg(target_feature = "eijmpcall")]
            "std Z+18, r24",                      // 2
            #[cfg(target_feature = "eijmpcall")]
            "swap r18",                           // 1
            #[cfg(target_feature = "eijmpcall")]
            "andi r18, 0x0f",                     // 1
            #[cfg(target_feature = "eijmpcall")]
            "1:",
            #[cfg(target_feature = "eijmpcall")]
            "mov r24, r18",                       // 1
            #[cfg(target_feature = "elpm")]
            "std Z+14, r25",                      // 2
            #[cfg(target_feature = "elpm")]
            "out 0x3b, r24",                      // 1: RAMPZ
            #[cfg(feature = "fault-early-enable")]
            "sei",
            "rjmp leave_interrupt",               // 2
            // Enters an interrupt: r31 and r30 are on the stack, Z is the handler's address in words.
            ".global kernel_enter_interrupt",
            "kernel_enter_interrupt:",
            "push r0",                            // 2
            "in r0, 0x3f",                        // 1: SREG; I is clear in it, and set in the end
            // The same for a vector that has pushed r31, r30 and r0 already, and has SREG in r0.
            ".global kernel_enter_with_status",
            "kernel_enter_with_status:",
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
            "in r28, 0x3d",                       // 1: Y = SP; the handler preserves it
            "in r29, 0x3e",                       // 1
            "ldi r24, hi8(__heap_start)",         // 1: the end of the kernel's stack, above all tasks' stacks
            "cpi r28, lo8(__heap_start)",         // 1
            "cpc r29, r24",                       // 1
            "brsh stay",                          // 1: not on a task's
            "ldi r24, lo8(__stack)",              // 1: the kernel's stack, empty
            "ldi r25, hi8(__stack)",              // 1
            "out 0x3e, r25",                      // 1: SPH
            "out 0x3d, r24",                      // 1: SPL
            #[cfg(feature = "tickless")]
            "rcall after_sleep",                  // 3
            "icall",                              // 3: the handler
            "lds r30, {kernel}+{running}",        // 2: Z = the task that runs
            "lds r31, {kernel}+{running}+1",      // 2
            "lds r24, {kernel}+{head}",           // 2: is it the head?
            "cpse r24, r30",                      // 1, or 2: the low bytes of two tasks are seldom the same
            "rjmp save",                          // 2
            "lds r24, {kernel}+{head}+1",         // 2
            "cpse r24, r31",                      // 1, or 2
            "rjmp save",                          // 2
            // Leaves an interrupt to what it preempted.
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
            "sei",                                // 1: takes effect after the next instruction,
            "preempted_goes_on:",
            "ret",                                // 4: so a pending interrupt precedes the preempted code
            // The interrupt stays on the kernel's stack.
            "stay:",
            #[cfg(feature = "tickless")]
            "rcall after_sleep",                  // 3
            "icall",                              // 3: the handler
            "ldi r24, hi8(__stack - {frame})",    // 1: is the stack empty, but for this interrupt?
            "cpi r28, lo8(__stack - {frame})",    // 1
            "cpc r29, r24",                       // 1
            "brne return_from_interrupt",         // 1: no, an ISR is preempted, which switches at its end
            "lds r30, {kernel}+{running}",        // 2
            "lds r31, {kernel}+{running}+1",      // 2
            "ldi r24, hi8({idle_task})",          // 1
            "cpi r30, lo8({idle_task})",          // 1: the idle task?
            "cpc r31, r24",                       // 1
            "brne return_from_interrupt",         // 1: no, a context is being saved, and what should run is asked after that
            "rjmp kernel_run_head",               // 2: yes, it has no context to return to
            // Counts the ticks that have passed in a sleep. Preserves Z.
            #[cfg(feature = "tickless")]
            "after_sleep:",
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
            #[cfg(feature = "tickless")]
            "ret",                                // 4
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
            sp = const STACK_POINTER,
            #[cfg(feature = "stack-check")]
            check = sym super::stack_check::check_before_switch,
            #[cfg(feature = "cpu-time")]
            charge = sym crate::cpu_time::charge_before_switch,
            kernel = sym KERNEL,
            idle_task = sym IDLE,
            head = const HEAD,
            running = const RUNNING,
            frame = const FRAME,
            options(noreturn),
        )
    }
}
