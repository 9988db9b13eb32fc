//! Timers: arming and disarming along their list, with interrupts enabled after each step, and delays.
//!
//! On the host, and before the kernel runs, `timer` does the same in Rust.

use core::arch::asm;
use core::mem::MaybeUninit;
use core::ops::Range;

use super::{DEADLINE, FIRST_TIMER, LINK, NEXT_DEADLINE, RUNNING, TARGET, WALK};
use crate::context::Task;
use crate::link;
use crate::target::Target;
use crate::timer::{Ticks, Timer};
use crate::{KERNEL, TICKS_LEFT};

/// Arms `timer`, anew if it is armed. `false`, with nothing done, if `deadline` has passed.
#[inline(always)]
pub(crate) fn arm(_: &mut Task, timer: &'static Timer, deadline: Ticks, target: Target) -> bool {
    // SAFETY: a task calls this, with interrupts enabled, and the list becomes what it should.
    unsafe { kernel_arm(timer, deadline, target) }
}

/// Disarms `timer`. Returns whether it was armed.
#[inline(always)]
pub(crate) fn disarm(_: &mut Task, timer: &'static Timer) -> bool {
    // SAFETY: as above.
    unsafe { kernel_disarm(timer) }
}

/// Disarms the first timer that lies in `memory`. Returns whether there was one.
#[inline(always)]
pub(crate) fn disarm_within(_: &mut Task, memory: Range<usize>) -> bool {
    // SAFETY: as above.
    unsafe { kernel_disarm_within(memory.start, memory.end) }
}

/// Blocks the task until `deadline`. Returns `false` at once if that has passed.
#[inline(always)]
pub(crate) fn delay_until(_: &mut Task, deadline: Ticks) -> bool {
    // On the task's stack, which is taken from it only when its timers have left their list.
    let mut timer = MaybeUninit::<Timer>::uninit();
    let has_waited: u16;
    // SAFETY: a task calls this, with interrupts enabled. All that changes meanwhile is declared.
    unsafe {
        asm!(
            "call {delay}", // 4
            delay = sym kernel_delay,
            inout("Z") timer.as_mut_ptr() => _,
            inout("r25r24") deadline => has_waited,
            out("r2") _, out("r3") _, out("r4") _, out("r5") _, out("r6") _, out("r7") _,
            out("r8") _, out("r9") _, out("r10") _, out("r11") _, out("r12") _, out("r13") _,
            out("r14") _, out("r15") _, out("r16") _, out("r17") _, out("r18") _, out("r19") _,
            out("r20") _, out("r21") _, out("r22") _, out("r23") _, out("X") _,
        )
    }
    has_waited >> 8 != 0
}

unsafe extern "C" {
    fn kernel_arm(timer: &Timer, deadline: Ticks, target: Target) -> bool;
    fn kernel_disarm(timer: &Timer) -> bool;
    fn kernel_disarm_within(start: usize, end: usize) -> bool;
}

/// Blocks the running task until the tick r25:r24, by a timer in the memory at Z. r25 = 0 if that has passed.
///
/// All registers but Y are lost.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".lowtext.kernel.delay")]
#[inline(never)]
unsafe extern "C" fn kernel_delay() {
    // SAFETY: a task calls this.
    unsafe {
        asm!(
            "push r28",                           // 2: as for a switch
            "push r29",                           // 2
            "movw r28, r30",                      // 1: Y = the timer
            "movw r22, r24",                      // 1: r23:r22 = the deadline
            "lds r20, {kernel}+{running}",        // 2: r21:r20 = what it wakes: the running task
            "lds r21, {kernel}+{running}+1",      // 2
            "ori r21, 0x80",                      // 1
            "std Y+{target}+1, r1",               // 2: it is not armed
            "rcall kernel_arm_timer",             // 3
            "clr r25",                            // 1
            "tst r24",                            // 1
            "breq 4f",                            // 1: the deadline has passed
            "cli",                                // 1
            "ldd r18, Y+{target}+1",              // 2
            "tst r18",                            // 1
            "breq 3f",                            // 1: it is over already
            "rcall kernel_leave_head",            // 34 at most: Y = the running task
            "ldi r18, {delayed}",                 // 1
            "std Y+{link}, r1",                   // 2
            "std Y+{link}+1, r18",                // 2
            "movw r30, r28",                      // 1
            "sei",                                // 1
            "rjmp kernel_save",                   // 2: which leaves the high byte of a stack pointer in r25
            "3:",
            "sei",                                // 1
            "ldi r25, 1",                         // 1
            "4:",
            "pop r29",                            // 2
            "pop r28",                            // 2
            kernel = sym KERNEL,
            target = const TARGET,
            running = const RUNNING,
            link = const LINK,
            delayed = const (link::DELAYED >> 8),
        )
    }
}

const _: () = assert!(link::DELAYED & 0xff == 0);

/// Arms the timer Y to wake r21:r20 at the tick r23:r22. r24 = whether that is ahead.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".lowtext.kernel.arm")]
#[inline(never)]
#[expect(
    named_asm_labels,
    reason = "other code jumps to them, and a function that is not inlined stands once"
)]
unsafe extern "C" fn kernel_arm_timer() {
    // SAFETY: a task calls this, with interrupts enabled.
    unsafe {
        asm!(
            "cli",                                // 1
            "rjmp 3f",                            // 2
            "2:",
            "cli",                                // 1
            "lds r18, {kernel}+{walk}",           // 2
            "tst r18",                            // 1: does the walk go on?
            "brne 5f",                            // 2, or 1
            // Once in a walk: whoever arms it meanwhile ends the walk.
            "3:",
            "ldd r18, Y+{target}+1",              // 2
            "tst r18",                            // 1
            "brne 9f",                            // 1: it is armed
            "rcall ticks_until",                  // 3
            "brge 8f",                            // 1
            "std Y+{deadline}, r22",              // 2
            "std Y+{deadline}+1, r23",            // 2
            "ldi r18, 1",                         // 1
            "sts {kernel}+{walk}, r18",           // 2
            "ldi r26, lo8({kernel}+{first})",     // 1
            "ldi r27, hi8({kernel}+{first})",     // 1: X = what leads to the next timer
            "4:",
            "sei",                                // 1
            "rjmp 2b",                            // 2
            // A step.
            "5:",
            "ld r30, X+",                         // 2: Z = the next timer
            "ld r31, X",                          // 2
            "tst r31",                            // 1
            "breq 6f",                            // 1: there is none
            "ldd r18, Z+{deadline}",              // 2
            "ldd r19, Z+{deadline}+1",            // 2
            "cp r22, r18",                        // 1: both are ahead, so the difference tells which is first
            "cpc r23, r19",                       // 1
            "brmi 6f",                            // 1
            "movw r26, r30",                      // 1
            "rjmp 4b",                            // 2
            // Its place is before Z. X = the high byte of what leads there.
            "6:",
            "ldi r18, hi8({kernel}+{first}+1)",   // 1
            "cpi r26, lo8({kernel}+{first}+1)",   // 1
            "cpc r27, r18",                       // 1
            "brne 7f",                            // 1: it is not the first
            "rcall ticks_until",                  // 3
            "brge 8f",                            // 1: it is not ahead any more
            "sts {kernel}+{next}, r22",           // 2: ticks count down to it
            "sts {kernel}+{next}+1, r23",         // 2
            "sts {left}, r18",                    // 2
            "sts {left}+1, r19",                  // 2
            "7:",
            "st X, r29",                          // 2
            "st -X, r28",                         // 2
            "st Y, r30",                          // 2
            "std Y+1, r31",                       // 2
            "std Y+{target}, r20",                // 2
            "std Y+{target}+1, r21",              // 2
            "ldi r24, 1",                         // 1
            "rjmp end_walk",                      // 2
            "8:",
            "clr r24",                            // 1
            "end_walk:",
            "sts {kernel}+{walk}, r1",            // 2
            "sei",                                // 1
            "ret",                                // 4
            // It is disarmed first.
            "9:",
            "sei",                                // 1
            "push r20",                           // 2
            "push r21",                           // 2
            "push r22",                           // 2
            "push r23",                           // 2
            "movw r24, r28",                      // 1
            "rcall kernel_disarm_timer",          // 3
            "pop r23",                            // 2
            "pop r22",                            // 2
            "pop r21",                            // 2
            "pop r20",                            // 2
            "rjmp kernel_arm_timer",              // 2
            // r19:r18 = the ticks until the deadline r23:r22, and what `brge` takes for it is not ahead. It changes r24 and r25.
            "ticks_until:",
            "movw r18, r22",                      // 1
            "lds r24, {kernel}+{next}",           // 2
            "lds r25, {kernel}+{next}+1",         // 2
            "sub r18, r24",                       // 1: from the deadline to which ticks count down
            "sbc r19, r25",                       // 1
            "lds r24, {left}",                    // 2
            "lds r25, {left}+1",                  // 2
            "add r18, r24",                       // 1
            "adc r19, r25",                       // 1
            "cp r1, r18",                         // 1
            "cpc r1, r19",                        // 1
            "ret",                                // 4
            // The same for Rust, with r25:r24 instead of Y.
            ".global kernel_arm",
            "kernel_arm:",
            "push r28",                           // 2
            "push r29",                           // 2
            "movw r28, r24",                      // 1
            "rcall kernel_arm_timer",             // 3
            "pop r29",                            // 2
            "pop r28",                            // 2
            kernel = sym KERNEL,
            left = sym TICKS_LEFT,
            first = const FIRST_TIMER,
            next = const NEXT_DEADLINE,
            deadline = const DEADLINE,
            target = const TARGET,
            walk = const WALK,
        )
    }
}

/// Disarms the timer r25:r24. r24 = whether it was armed.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".lowtext.kernel.disarm")]
#[inline(never)]
#[expect(
    named_asm_labels,
    reason = "other code jumps to them, and a function that is not inlined stands once"
)]
unsafe extern "C" fn kernel_disarm_timer() {
    // SAFETY: a task calls this, with interrupts enabled.
    unsafe {
        asm!(
            ".global kernel_disarm",
            "kernel_disarm:",
            "movw r30, r24",                      // 1
            "ldd r23, Z+{target}+1",              // 2: not 0 while it is armed
            "tst r23",                            // 1
            "breq 6f",                            // 1
            "movw r22, r24",                      // 1
            "subi r22, -1",                       // 1
            "sbci r23, -1",                       // 1
            // The first that lies from r25:r24 up to r23:r22.
            ".global kernel_disarm_within",
            "kernel_disarm_within:",
            "ldi r20, hi8({kernel}+{first})",     // 1
            "cli",                                // 1
            "rjmp 3f",                            // 2
            "2:",
            "cli",                                // 1
            "lds r18, {kernel}+{walk}",           // 2
            "tst r18",                            // 1: does the walk go on?
            "brne 4f",                            // 2, or 1
            "3:",
            "ldi r18, 1",                         // 1
            "sts {kernel}+{walk}, r18",           // 2
            "ldi r26, lo8({kernel}+{first})",     // 1: X = what leads to the next timer
            "mov r27, r20",                       // 1
            "4:",
            "ld r30, X+",                         // 2: Z = the next timer
            "ld r31, X",                          // 2
            "tst r31",                            // 1
            "breq 7f",                            // 1: there is none
            "cp r30, r24",                        // 1
            "cpc r31, r25",                       // 1
            "brlo 5f",                            // 1
            "cp r30, r22",                        // 1
            "cpc r31, r23",                       // 1
            "brlo 8f",                            // 1, or 2
            "5:",
            "movw r26, r30",                      // 1
            "sei",                                // 1
            "rjmp 2b",                            // 2
            "6:",
            "mov r24, r23",                       // 1
            "ret",                                // 4
            "7:",
            "sts {kernel}+{walk}, r1",            // 2: ends a walk
            "sei",                                // 1
            "clr r24",                            // 1
            "ret",                                // 4
            "8:",
            "ld r18, Z",                          // 2
            "ldd r19, Z+1",                       // 2
            "st X, r19",                          // 2
            "st -X, r18",                         // 2
            "std Z+{target}, r1",                 // 2
            "std Z+{target}+1, r1",               // 2
            "cpi r26, lo8({kernel}+{first})",     // 1
            "cpc r27, r20",                       // 1
            "brne 9f",                            // 1
            "rcall kernel_count_down",            // 3: it was the first
            "9:",
            "sts {kernel}+{walk}, r1",            // 2
            "sei",                                // 1
            "ldi r24, 1",                         // 1
            kernel = sym KERNEL,
            first = const FIRST_TIMER,
            target = const TARGET,
            walk = const WALK,
        )
    }
}
