//! The expiry of timers: see [`timer`](crate::timer).
//!
//! On the host [`timer`](crate::timer) does the same in Rust.

use core::arch::asm;

use super::{DEADLINE, FIRST_TIMER, LINK, NEXT_DEADLINE, TARGET, WALK};
use crate::{IDLE, KERNEL, TICKS_LEFT};

/// Wakes one timer's task or posts its semaphore at a time, and lets interrupts strike in between. No task runs meanwhile, and
/// interrupts leave timers alone. Until no timer is due the ticks left are not positive, so that no tick comes here as well.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".lowtext.kernel.expiry")]
#[inline(never)]
#[expect(
    named_asm_labels,
    reason = "other code jumps to them, and a function that is not inlined stands once"
)]
pub(super) unsafe extern "C" fn kernel_expire_timers() {
    // SAFETY: the tick's interrupt jumps here, with interrupts masked.
    unsafe {
        asm!(
            ".global expire",
            "expire:",
            "ldi r24, lo8(__stack - 1)",          // 1: not where a context that is being saved is struck
            // The same with SP at r24 in the page of the kernel's stack.
            ".global expire_at",
            "expire_at:",
            "out 0x3d, r24",                      // 1: SPL
            "1:",
            "sei",                                // 1
            "lds r30, {kernel}+{first}",          // 2: Z = the first timer
            "lds r31, {kernel}+{first}+1",        // 2
            "cli",                                // 1
            "tst r31",                            // 1
            "breq 4f",                            // 1: there is none
            "ld r18, Z",                          // 2
            "ldd r19, Z+1",                       // 2
            "ldd r24, Z+{target}",                // 2: r25:r24 = what it wakes
            "ldd r25, Z+{target}+1",              // 2
            "std Z+{target}, r1",                 // 2: it is not armed any more
            "std Z+{target}+1, r1",               // 2
            "sts {kernel}+{first}, r18",          // 2
            "sts {kernel}+{first}+1, r19",        // 2
            "sts {kernel}+{walk}, r1",            // 2: ends a walk
            "sei",                                // 1
            "movw r30, r24",                      // 1
            "cli",                                // 1
            "sbrs r25, 7",                        // 1, or 2: skips the next for a task
            "rjmp 5f",                            // 2
            "andi r31, 0x7f",                     // 1: Z = the task
            "ldd r24, Z+{link}+1",                // 2
            "cpi r24, {delayed}",                 // 1
            "brne 3f",                            // 1: its delay has not begun
            "rcall kernel_make_ready",            // 3
            "3:",
            "sei",                                // 1
            "lds r18, {kernel}+{first}",          // 2: r19:r18 = the first timer
            "cli",                                // 1
            "4:",
            "lds r19, {kernel}+{first}+1",        // 2
            "rcall kernel_count_down",            // 3
            "brge 1b",                            // 1, or 2: it is due, too
            "sei",                                // 1
            "nop",                                // 1
            "cli",                                // 1
            "rjmp exit_interrupt",                // 2
            // Posts a semaphore; or ends a wait, if it is the mark of a time-out.
            "5:",
            "ld r18, Z",                          // 2
            "ldd r19, Z+1",                       // 2
            "ldi r20, hi8({idle_task})",          // 1
            "cpi r18, lo8({idle_task})",          // 1
            "cpc r19, r20",                       // 1
            "breq 6f",                            // 1
            "sei",                                // 1
            "ldi r21, 1",                         // 1
            "cli",                                // 1
            "rcall kernel_signal",                // 3
            "rjmp 3b",                            // 2
            "6:",
            "rcall 7f",                           // 3
            "rjmp 3b",                            // 2
            ".weak kernel_elapse",                // of who waits with a time-out
            "7:",
            "jmp kernel_elapse",                  // 3
            // Ticks count down to the timer r19:r18, or a long while if r19 is 0. `brge` takes it for one that is not ahead.
            ".global kernel_count_down",
            "kernel_count_down:",
            "lds r20, {kernel}+{next}",           // 2: r21:r20 = the deadline before
            "lds r21, {kernel}+{next}+1",         // 2
            "movw r30, r18",                      // 1
            "movw r18, r20",                      // 1
            "subi r18, lo8({earlier})",           // 1
            "sbci r19, hi8({earlier})",           // 1
            "tst r31",                            // 1
            "breq 8f",                            // 1, or 2
            "ldd r18, Z+{deadline}",              // 2
            "ldd r19, Z+{deadline}+1",            // 2
            "8:",
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
            kernel = sym KERNEL,
            idle_task = sym IDLE,
            left = sym TICKS_LEFT,
            earlier = const crate::timer::LONGEST.wrapping_neg(),
            first = const FIRST_TIMER,
            next = const NEXT_DEADLINE,
            deadline = const DEADLINE,
            target = const TARGET,
            delayed = const (crate::link::DELAYED >> 8),
            walk = const WALK,
            link = const LINK,
        )
    }
}
