//! The context switch: entry and exit of interrupts, saving and taking up of contexts, and the scheduler.

use core::arch::asm;

use super::{
    ARRIVED, DEADLINE, FIRST_TIMER, FRAME, HEAD, IDLE_STACK, LAST, LINK, NEXT_DEADLINE, RUNNING,
    STACK_POINTER, TARGET, WALK,
};
use crate::{IDLE, KERNEL, TICKS_LEFT};

unsafe extern "C" {
    /// Runs the tasks. Interrupts are masked, and what ran is not needed any more.
    pub(super) fn kernel_run() -> !;
    #[doc(hidden)]
    pub fn kernel_enter_interrupt();
    #[doc(hidden)]
    pub fn kernel_enter_with_status();
    #[doc(hidden)]
    pub fn kernel_expire();
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
pub(super) unsafe extern "C" fn kernel_switch() {
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
            ".global kernel_run",
            "kernel_run:",
            "rjmp resume_head",                   // 2
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
            "ldi r18, lo8({idle_task})",          // 1
            "ldi r19, hi8({idle_task})",          // 1
            "sts {kernel}+{running}, r18",        // 2
            "sts {kernel}+{running}+1, r19",      // 2
            "ldi r18, lo8(__stack)",              // 1: the idle task's stack, empty
            "ldi r19, hi8(__stack)",              // 1
            "out 0x3e, r19",                      // 1: SPH
            "sei",                                // 1
            "out 0x3d, r18",                      // 1: SPL
            "andi r25, 0x7f",                     // 1: the stack pointer without its mark
            "breq no_task",                       // 1
            "movw r22, r30",                      // 1: r23:r22 = the head
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
            "sts {kernel}+{running}, r22",        // 2
            "sts {kernel}+{running}+1, r23",      // 2
            "out 0x3e, r25",                      // 1: SPH
            "out 0x3d, r24",                      // 1: SPL
            // RAMPZ, which the context holds in bit 7 of SREG.
            #[cfg(target_feature = "elpm")]
            "ldd r25, Z+29",                      // 2: SREG
            #[cfg(all(target_feature = "elpm", not(target_feature = "eijmpcall")))]
            "clr r24",                            // 1
            #[cfg(all(target_feature = "elpm", not(target_feature = "eijmpcall")))]
            "lsl r25",                            // 1: carry = RAMPZ
            #[cfg(all(target_feature = "elpm", not(target_feature = "eijmpcall")))]
            "rol r24",                            // 1
            #[cfg(all(target_feature = "elpm", not(target_feature = "eijmpcall")))]
            "lsr r25",                            // 1: SREG as `reti` wants it
            #[cfg(target_feature = "eijmpcall")]
            "clr r18",                            // 1
            #[cfg(target_feature = "eijmpcall")]
            "bst r25, 7",                         // 1: is any of its bits set?
            #[cfg(target_feature = "eijmpcall")]
            "brtc 1f",                            // 1, or 2
            #[cfg(target_feature = "eijmpcall")]
            "andi r25, 0x7f",                     // 1: SREG as `reti` wants it
            #[cfg(target_feature = "eijmpcall")]
            "ldd r18, Z+33",                      // 2: above the highest bits of PC
            #[cfg(target_feature = "eijmpcall")]
            "mov r24, r18",                       // 1
            #[cfg(target_feature = "eijmpcall")]
            "andi r24, 0x0f",                     // 1: PC as `reti` wants it
            #[cfg(target_feature = "eijmpcall")]
            "std Z+33, r24",                      // 2
            #[cfg(target_feature = "eijmpcall")]
            "swap r18",                           // 1
            #[cfg(target_feature = "eijmpcall")]
            "andi r18, 0x0f",                     // 1
            #[cfg(target_feature = "eijmpcall")]
            "1:",
            #[cfg(target_feature = "eijmpcall")]
            "mov r24, r18",                       // 1
            #[cfg(target_feature = "elpm")]
            "std Z+29, r25",                      // 2
            #[cfg(target_feature = "elpm")]
            "out 0x3b, r24",                      // 1: RAMPZ
            #[cfg(feature = "fault-early-enable")]
            "sei",
            "rjmp leave_interrupt",               // 2
            // The head is no task, but the idle one or the scheduler, as bit 0 tells.
            "no_task:",
            "sbrs r24, 0",                        // 1, or 2
            "rjmp idle",                          // 2
            // The scheduler, with Z. It puts the first of the highest that have arrived before the next task, if it outranks
            // that. Who arrives meanwhile begins this anew; so does any other interrupt.
            "ldd r26, Z+{link}",                  // 2: X = the next task
            "ldd r27, Z+{link}+1",                // 2
            "ld r18, X",                          // 2: the priorities above
            "lds r19, {kernel}+{arrived}",        // 2
            "and r18, r19",                       // 1
            "movw r20, r26",                      // 1: r21:r20 = the next task
            "breq 5f",                            // 1: none of them has arrived, after all
            "ldi r26, lo8({kernel}+{last})",      // 1: X = where the last of the highest is
            "ldi r27, hi8({kernel}+{last})",      // 1
            "2:",
            "lsr r18",                            // 1
            "brcs 3f",                            // 1, or 2
            "adiw r26, 2",                        // 2
            "rjmp 2b",                            // 2
            "3:",
            "cli",                                // 1
            "ld r30, X+",                         // 2: Z = the last
            "ld r31, X",                          // 2
            "ldd r22, Z+{link}",                  // 2: r23:r22 = the first
            "ldd r23, Z+{link}+1",                // 2
            "cp r22, r30",                        // 1
            "cpc r23, r31",                       // 1
            "breq 6f",                            // 1, or 2: it is the only one
            "movw r26, r22",                      // 1: X = the first
            "adiw r26, {link}",                   // 2
            "ld r18, X+",                         // 2: the last leads to the second
            "ld r19, X",                          // 2
            "std Z+{link}, r18",                  // 2
            "std Z+{link}+1, r19",                // 2
            "4:",
            "movw r30, r22",                      // 1: Z = the first
            "std Z+{link}, r20",                  // 2: it goes before the next task
            "std Z+{link}+1, r21",                // 2
            "movw r20, r30",                      // 1
            "5:",
            "cli",                                // 1
            "sts {kernel}+{head}, r20",           // 2
            "sts {kernel}+{head}+1, r21",         // 2
            "rjmp resume_head",                   // 2
            "6:",
            "st X, r1",                           // 2: its queue is empty
            "st -X, r1",                          // 2
            "ld r18, Z",                          // 2: the priorities above
            "inc r18",                            // 1: its own
            "com r18",                            // 1
            "lds r19, {kernel}+{arrived}",        // 2
            "and r19, r18",                       // 1
            "sts {kernel}+{arrived}, r19",        // 2
            "rjmp 4b",                            // 2
            // The handler of a tick where idle is tickless.
            #[cfg(feature = "tickless")]
            ".global kernel_tickless",
            #[cfg(feature = "tickless")]
            "kernel_tickless:",
            #[cfg(feature = "tickless")]
            "call kernel_tick",                   // 4: r24 = whether a deadline is due
            #[cfg(feature = "tickless")]
            "cpse r24, r1",                       // 1, or 2 where none is
            #[cfg(feature = "tickless")]
            "rjmp kernel_expire",                 // 2
            #[cfg(feature = "tickless")]
            "ret",                                // 4
            // It has struck in the page of the kernel's stack.
            "expire_in_kernel:",
            "ldi r24, lo8(__stack - 1)",          // 1
            "cpi r28, lo8(__stack - {idle})",     // 1: where the kernel itself has interrupts enabled, perhaps the idle task?
            "brlo 1f",                            // 1, or 2
            "mov r24, r28",                       // 1: below the context that it has laid
            "1:",
            "rjmp expire_at",                     // 2
            // The handler of a tick when a timer is due. First the commonest case, of a task whose delay is over and that outranks
            // the one to run.
            ".global kernel_expire",
            "kernel_expire:",
            "cpi r29, hi8(__stack)",              // 1
            "breq expire_in_kernel",              // 1
            "lds r30, {kernel}+{timer}",          // 2: Z = the first timer
            "lds r31, {kernel}+{timer}+1",        // 2
            "tst r31",                            // 1
            "breq 2f",                            // 1: there is none
            "ld r18, Z",                          // 2: r19:r18 = the next one
            "ldd r19, Z+1",                       // 2
            "ldd r24, Z+{target}",                // 2: what it wakes
            "ldd r25, Z+{target}+1",              // 2
            "sbrs r25, 7",                        // 2: skips the next for a task
            "2:",
            "rjmp expire",                        // 2
            "andi r25, 0x7f",                     // 1
            "movw r30, r24",                      // 1: Z = the task
            "ldd r24, Z+{link}+1",                // 2
            "cpi r24, {delayed}",                 // 1
            "brne 2b",                            // 1: its delay has not begun
            "lds r26, {kernel}+{head}",           // 2: X = the head
            "lds r27, {kernel}+{head}+1",         // 2
            "ld r24, X",                          // 2: the priorities above that
            "ld r25, Z",                          // 2: and above the task
            "cp r25, r24",                        // 1
            "brsh 2b",                            // 1
            "std Z+{link}, r26",                  // 2: the task goes before the head
            "std Z+{link}+1, r27",                // 2
            "sts {kernel}+{head}, r30",           // 2
            "sts {kernel}+{head}+1, r31",         // 2
            "sts {kernel}+{timer}, r18",          // 2: and the timer from its list
            "sts {kernel}+{timer}+1, r19",        // 2
            "sts {kernel}+{walk}, r1",            // 2: ends a walk
            "tst r19",                            // 1
            "breq 2b",                            // 1: it was the last timer
            "movw r30, r18",                      // 1: Z = the next timer
            "ldd r24, Z+{deadline}",              // 2
            "ldd r25, Z+{deadline}+1",            // 2
            "lds r18, {kernel}+{next}",           // 2: the deadline that has come, at this tick
            "lds r19, {kernel}+{next}+1",         // 2
            "sts {kernel}+{next}, r24",           // 2
            "sts {kernel}+{next}+1, r25",         // 2
            "sub r24, r18",                       // 1: ticks from that to the next
            "sbc r25, r19",                       // 1
            "sts {left}, r24",                    // 2
            "sts {left}+1, r25",                  // 2
            "breq 2b",                            // 1: it is due, too
            "rjmp exit_interrupt",                // 2
            // Enters an interrupt: r31 and r30 are on the stack, Z is the handler's address in words.
            ".global kernel_enter_interrupt",
            "kernel_enter_interrupt:",
            "push r0",                            // 2
            "in r0, 0x3f",                        // 1: SREG; I is clear in it, `reti` sets it
            // The same from a vector that has done so much.
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
            "in r28, 0x3d",                       // 1: Y = SP of the interrupted task; the handler preserves it
            "in r29, 0x3e",                       // 1
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
            ".global exit_interrupt",
            "exit_interrupt:",
            "lds r30, {kernel}+{running}",        // 2: Z = the task that runs
            "lds r31, {kernel}+{running}+1",      // 2
            "lds r24, {kernel}+{head}",           // 2: is it the one that should?
            "cpse r24, r30",                      // 1, or 2: low bytes of two tasks seldom are the same
            "rjmp preempt",                       // 2
            "lds r24, {kernel}+{head}+1",         // 2
            "cpse r24, r31",                      // 1, or 2
            "rjmp preempt",                       // 2
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
            // The interrupt struck in the page of the kernel's stack.
            "struck_kernel:",
            "cpi r28, lo8(__stack - {idle})",     // 1: or was it a task whose stack reaches there?
            "brlo save",                          // 2
            "cpi r28, lo8(__stack - {frame})",    // 1: the expiry of timers?
            "brne return_from_interrupt",         // 1: that goes on, and the switch comes at its end
            "ldi r24, hi8({idle_task})",          // 1
            "cpi r30, lo8({idle_task})",          // 1: the idle task?
            "cpc r31, r24",                       // 1
            #[cfg(not(feature = "fault-stale-head"))]
            "brne return_from_interrupt",         // 1: no, a context is being saved, and what should run is asked after that
            #[cfg(feature = "fault-stale-head")]
            "brne go_on_with_head",
            "rjmp resume_head",                   // 2: it has nothing to go on with
            #[cfg(feature = "fault-stale-head")]
            "go_on_with_head:",
            #[cfg(feature = "fault-stale-head")]
            "lds r24, {kernel}+{head}",
            #[cfg(feature = "fault-stale-head")]
            "std Y+4, r24",                       // tells `save` of a new head, in its X
            #[cfg(feature = "fault-stale-head")]
            "lds r24, {kernel}+{head}+1",
            #[cfg(feature = "fault-stale-head")]
            "std Y+3, r24",
            #[cfg(feature = "fault-stale-head")]
            "rjmp return_from_interrupt",
            // Saves the other half of a preempted context, with interrupts enabled: on the idle task's stack, and through Y.
            "preempt:",
            "cpi r29, hi8(__stack)",              // 1: where the interrupt struck on the kernel's own stack
            "breq struck_kernel",                 // 1: there may be nothing to save
            "save:",
            #[cfg(feature = "fault-stale-head")]
            "lds r26, {kernel}+{head}",
            #[cfg(feature = "fault-stale-head")]
            "lds r27, {kernel}+{head}+1",
            "ldi r24, lo8(__stack)",              // 1: SPH is that of the kernel's stack already
            "out 0x3d, r24",                      // 1: SPL
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
            ".global return_to_task",
            "return_to_task:",
            "pop r29",                            // 2
            "pop r28",                            // 2, and the `ret` to where the task has blocked 4
            sp = const STACK_POINTER,
            #[cfg(feature = "cpu-time")]
            charge = sym crate::cpu_time::charge_before_switch,
            left = sym TICKS_LEFT,
            timer = const FIRST_TIMER,
            next = const NEXT_DEADLINE,
            deadline = const DEADLINE,
            target = const TARGET,
            delayed = const (crate::link::DELAYED >> 8),
            last = const LAST,
            link = const LINK,
            arrived = const ARRIVED,
            walk = const WALK,
            kernel = sym KERNEL,
            idle_task = sym IDLE,
            head = const HEAD,
            running = const RUNNING,
            frame = const FRAME,
            idle = const IDLE_STACK,
        )
    }
}
