//! Control blocks that stand in for a task where that waits for several semaphores: see [`group`](crate::group).
//!
//! On the host `Group` does the same in Rust.

use core::arch::asm;

use super::{AWAITED, GROUPED_TASK, LINK, PRIORITY, STACK_POINTER};
use crate::link;
use crate::task::Flag;

/// Wakes the task for which Z stands in, that was the first to wait for a semaphore. r24 = whether another task is to run now.
///
/// Interrupts are masked. They strike in between, unless r21 is 0. What else a call may change is changed.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".lowtext.kernel.stand_in")]
#[inline(never)]
#[expect(named_asm_labels, reason = "a label for one place only, in a function that is not inlined")]
pub(super) unsafe extern "C" fn kernel_wake_stand_in() {
    // SAFETY: `kernel_signal` jumps here.
    unsafe {
        asm!(
            "ldd r26, Z+{sp}",                    // 2: X = its group
            "ldd r27, Z+{sp}+1",                  // 2
            "adiw r26, {grouped_task}",           // 2
            "ld r22, X+",                         // 2: r23:r22 = that task
            "ld r23, X",                          // 2
            "tst r21",                            // 1
            "breq join",                          // 1
            "ldd r20, Z+{awaited}",               // 2: r21:r20 = the semaphore
            "ldd r21, Z+{awaited}+1",             // 2
            "movw r26, r20",                      // 1: as if nothing had been done
            "st X+, r30",                         // 2
            "st X, r31",                          // 2
            // Wakes that task first, if it waits. Should it run before the signal is there, it waits again.
            "clt",                                // 1: T = whether it is to run
            "3:",
            "sei",                                // 1
            "nop",                                // 1
            "cli",                                // 1
            "movw r30, r22",                      // 1: Z = the task
            "ldd r24, Z+{link}+1",                // 2
            "cpi r24, {grouped}",                 // 1
            "brne 4f",                            // 1, or 2
            "rcall kernel_make_ready",             // 4
            "bst r24, 0",                         // 1
            "4:",
            "sei",                                // 1
            "nop",                                // 1
            "cli",                                // 1
            // The signal is yet to come, and the lists may have changed.
            "movw r26, r20",                      // 1: X = the semaphore
            "ld r30, X+",                         // 2: Z = the first that waits
            "ld r31, X",                          // 2
            "cp r1, r31",                         // 1
            "brge 5f",                            // 1: none does
            "ldd r25, Z+{priority}",              // 2
            "sbrs r25, {stands_in}",              // 2, or 1
            "rjmp 1f",                            // 2: a task does
            "ldd r26, Z+{sp}",                    // 2: X = the group
            "ldd r27, Z+{sp}+1",                  // 2
            "adiw r26, {grouped_task}",           // 2
            "ld r22, X+",                         // 2
            "ld r23, X",                          // 2
            "movw r18, r30",                      // 1
            "movw r30, r22",                      // 1
            "ldd r24, Z+{link}+1",                // 2
            "cpi r24, {grouped}",                 // 1
            "breq 3b",                            // 1: its task waits again
            "movw r30, r18",                      // 1
            "ldd r24, Z+{link}",                  // 2
            "ldd r25, Z+{link}+1",                // 2
            // Puts Z behind those of the group that were woken. X is at the end of the group.
            "join:",
            "sbiw r26, {grouped_task} + 1",       // 2
            "ld r18, X+",                         // 2: the last of them
            "ld r19, X",                          // 2
            "st X, r31",                          // 2
            "st -X, r30",                         // 2
            "tst r19",                            // 1
            "breq 6f",                            // 1: there was none
            "movw r26, r18",                      // 1
            "adiw r26, {link}",                   // 2
            "ld r18, X",                          // 2: it leads to the first
            "st X+, r30",                         // 2
            "ld r19, X",                          // 2
            "st X, r31",                          // 2
            "std Z+{link}, r18",                  // 2
            "std Z+{link}+1, r19",                // 2
            "7:",
            "tst r21",                            // 1
            "breq 8f",                            // 1
            "movw r26, r20",                      // 1: X = the semaphore
            "st X+, r24",                         // 2: the next one is the first now
            "st X, r25",                          // 2
            "9:",
            "clr r24",                            // 1
            "bld r24, 0",                         // 1
            "ret",                                // 4
            "6:",
            "std Z+{link}, r30",                  // 2: a ring of one
            "std Z+{link}+1, r31",                // 2
            "rjmp 7b",                            // 2
            "8:",
            "movw r30, r22",                      // 1: Z = the task
            "ldd r24, Z+{link}+1",                // 2
            "cpi r24, {grouped}",                 // 1
            "brne 9b",                            // 1, or 2
            "rjmp kernel_make_ready",             // 2
            // No task waits: the signal is stored. X is at the high byte of the semaphore's word.
            "5:",
            "movw r18, r30",                      // 1
            "rcall kernel_store_signal",           // 4
            "rjmp 2f",                            // 2
            // A task waits that stands for itself.
            "1:",
            "ldd r18, Z+{link}",                  // 2
            "ldd r19, Z+{link}+1",                // 2
            "st X, r19",                          // 2
            "st -X, r18",                         // 2
            "rcall kernel_make_ready",             // 4
            "2:",
            "brtc 1f",                            // 2, or 1
            "ldi r24, 1",                         // 1
            "1:",
            "ret",                                // 4
            sp = const STACK_POINTER,
            stands_in = const (Flag::StandsIn as u8).trailing_zeros(),
            grouped_task = const GROUPED_TASK,
            awaited = const AWAITED,
            grouped = const (link::GROUPED >> 8),
            priority = const PRIORITY,
            link = const LINK,
        )
    }
}
