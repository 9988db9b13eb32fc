//! Waits where there is more to them than that a task is the first to wait: by priority, along the list of those that wait, with
//! interrupts enabled after each step. See [`walk`](crate::walk).
//!
//! On the host [`Semaphore`] and `ready` do the same in Rust.

use core::arch::asm;
use core::mem::offset_of;

use super::{ARRIVED, HEAD, LAST, LINK, PRIORITY, WALK};
use crate::KERNEL;
use crate::context::Task;
use crate::link;
use crate::semaphore::{Came, Semaphore, Until};
use crate::task::ControlBlock;

/// Takes a signal of `semaphore`, unless `until` has come; else has `own` wait, the running task or what stands in for one.
#[inline(always)]
pub(crate) fn enter_list(
    semaphore: &Semaphore,
    _: &mut Task,
    own: &'static ControlBlock,
    until: Option<&Until>,
) -> Came {
    // SAFETY: a task calls this, with interrupts enabled, and the lists become what they should.
    unsafe { kernel_enter(semaphore, own, until) }
}

/// Puts the highest task that has arrived behind the running one, if it should run before what is there.
///
/// A task of the running one's own priority must not stay there unless that blocks: [`push`] puts it back.
#[inline(always)]
pub(crate) fn pull(_: &mut Task) {
    // SAFETY: as above.
    unsafe { kernel_pull() }
}

/// Puts what [`pull`] has taken back as the first of its queue, where the running task does not block after all.
#[inline(always)]
pub(crate) fn push(_: &mut Task) {
    // SAFETY: as above.
    unsafe { kernel_push() }
}

unsafe extern "C" {
    fn kernel_enter(semaphore: &Semaphore, own: &ControlBlock, until: Option<&Until>) -> Came;
    fn kernel_pull();
    fn kernel_push();
}

/// The assembly of these.
///
/// All of it preserves what a call does, but where another is said. Interrupts are enabled.
#[unsafe(no_mangle)]
#[inline(never)]
#[expect(
    named_asm_labels,
    reason = "other code jumps to them, and a function that is not inlined stands once"
)]
pub(super) unsafe extern "C" fn kernel_enter_list() {
    // SAFETY: a task calls this.
    unsafe {
        asm!(
            // Has Y wait at the semaphore r25:r24, unless what r21:r20 points to has come, if r21 is not 0. r24 = what came.
            "clr r19",                            // 1: r19:r18 = who was first when the walk began: nobody
            "1:",
            "cli",                                // 1
            "movw r30, r24",                      // 1
            "ld r22, Z",                          // 2: r23:r22 = the semaphore's word
            "ldd r23, Z+1",                       // 2
            "tst r23",                            // 1
            "brmi 3f",                            // 1: it was left empty
            "breq 2f",                            // 1: it is a number
            "cp r22, r18",                        // 1: tasks wait: is the first the same,
            "cpc r23, r19",                       // 1
            "brne 3f",                            // 1
            "lds r30, {kernel}+{walk}",           // 2: and does the walk go on?
            "tst r30",                            // 1
            "brne 5f",                            // 2
            "rjmp 3f",                            // 2
            "2:",
            "subi r22, 1",                        // 1
            "brcs 3f",                            // 1: there is no signal
            "st Z, r22",                          // 2: one less
            "ldi r20, {signal}",                  // 1
            "rjmp 8f",                            // 2
            // No walk is under way.
            "3:",
            "tst r21",                            // 1
            "breq 4f",                            // 2
            "movw r30, r20",                      // 1
            "ld r26, Z",                          // 2: X = the set of flags
            "ldd r27, Z+1",                       // 2
            "ld r18, X",                          // 2
            "ldd r19, Z+{flags}",                 // 2
            "and r18, r19",                       // 1
            "ldd r19, Z+{least}",                 // 2
            "cp r18, r19",                        // 1
            "brsh 7f",                            // 1: it has come
            "4:",
            "movw r18, r22",                      // 1: a walk begins with the first
            "movw r26, r24",                      // 1: X = what leads to that: the semaphore
            "movw r30, r24",                      // 1: Z = the end of the list
            "ori r31, {end}",                     // 1
            "cp r1, r23",                         // 1
            "ld r0, X+",                          // 2: X = the high byte of what leads on, as at the end of a list
            "brge 6f",                            // 1: no task waits
            "ldi r22, 1",                         // 1
            "sts {kernel}+{walk}, r22",           // 2
            "sbiw r26, 1",                        // 2
            "sei",                                // 1
            "rjmp 1b",                            // 2
            // A step. X = what leads to the next.
            "5:",
            "ld r30, X+",                         // 2: Z = the next
            "ld r31, X",                          // 2
            "tst r31",                            // 1
            "brmi 6f",                            // 1: this is the end
            "ldd r22, Z+{priority}",              // 2
            "andi r22, 7",                        // 1
            "ldd r23, Y+{priority}",              // 2
            "andi r23, 7",                        // 1
            "cp r23, r22",                        // 1
            "brlo 6f",                            // 1: it is of lower priority
            "adiw r30, {link}",                   // 2
            "movw r26, r30",                      // 1
            "sei",                                // 1
            "rjmp 1b",                            // 2
            // The place is found: before Z. X = the high byte of what leads there.
            "6:",
            "movw r18, r30",                      // 1
            "lds r22, {kernel}+{head}",           // 2
            "cp r22, r28",                        // 1
            "lds r22, {kernel}+{head}+1",         // 2
            "cpc r22, r29",                       // 1
            "brne 9f",                            // 1: who is to wait stands in for a task
            "ldd r30, Y+{link}",                  // 2: Z = who runs next
            "ldd r31, Y+{link}+1",                // 2
            "ld r22, Z",                          // 2: the priorities above
            "lds r23, {kernel}+{arrived}",        // 2
            "and r22, r23",                       // 1
            "brne 10f",                           // 1: one that has arrived is to be pulled first
            "sts {kernel}+{head}, r30",           // 2
            "sts {kernel}+{head}+1, r31",         // 2
            "9:",
            "std Y+{link}, r18",                  // 2
            "std Y+{link}+1, r19",                // 2
            "st X, r29",                          // 2
            "st -X, r28",                         // 2
            "sts {kernel}+{walk}, r1",            // 2: ends a walk
            "sei",                                // 1
            "ldi r24, {blocked}",                 // 1
            "ret",                                // 4
            "10:",
            "sei",                                // 1
            "rcall pull_behind",                  // 3
            "clr r19",                            // 1
            "rjmp 1b",                            // 2
            "7:",
            "ldi r20, {until}",                   // 1
            "8:",
            "sei",                                // 1
            "rcall kernel_push",                  // 3: in vain unless one was pulled; seldom done
            "mov r24, r20",                       // 1
            "ret",                                // 4
            // The same for Rust, with r23:r22 instead of Y.
            ".global kernel_enter",
            "kernel_enter:",
            "push r28",                           // 2
            "push r29",                           // 2
            "movw r28, r22",                      // 1
            "rcall kernel_enter_list",            // 3
            "pop r29",                            // 2
            "pop r28",                            // 2
            "ret",                                // 4
            ".global kernel_pull",
            "kernel_pull:",
            "push r28",                           // 2
            "push r29",                           // 2
            "lds r28, {kernel}+{head}",           // 2: Y = the running task
            "lds r29, {kernel}+{head}+1",         // 2
            "rcall pull_behind",                  // 3
            "pop r29",                            // 2
            "pop r28",                            // 2
            "ret",                                // 4
            // Pulls behind Y, the running task. It leaves r25, r24, r21 and r20 alone.
            "pull_behind:",
            "cli",                                // 1
            "ldd r30, Y+{link}",                  // 2: Z = who runs next
            "ldd r31, Y+{link}+1",                // 2
            "ld r18, Z",                          // 2: the priorities above
            "lds r19, {kernel}+{arrived}",        // 2
            "sei",                                // 1
            "and r18, r19",                       // 1
            "breq 4f",                            // 1: none is to run before that
            "ldi r30, lo8({kernel}+{last})",      // 1: Z = where the last of the highest is
            "ldi r31, hi8({kernel}+{last})",      // 1
            "1:",
            "lsr r18",                            // 1
            "brcs 2f",                            // 1, or 2
            "adiw r30, 2",                        // 2
            "rjmp 1b",                            // 2
            // A section of its own, and much may have happened. If a higher one has arrived, it is pulled before this one next.
            "2:",
            "cli",                                // 1
            "ld r26, Z",                          // 2: X = the last
            "ldd r27, Z+1",                       // 2
            "tst r27",                            // 1
            "breq 5f",                            // 1: there is none any more
            "movw r18, r30",                      // 1
            "ld r0, X",                           // 2: the priorities above those that have arrived there
            "ldd r30, Y+{link}",                  // 2
            "ldd r31, Y+{link}+1",                // 2
            "ld r22, Z",                          // 2
            "cp r0, r22",                         // 1
            "brsh 5f",                            // 1
            "movw r30, r26",                      // 1: Z = the last
            "ldd r22, Z+{link}",                  // 2: r23:r22 = the first
            "ldd r23, Z+{link}+1",                // 2
            "cp r22, r30",                        // 1
            "cpc r23, r31",                       // 1
            "breq 6f",                            // 1
            "movw r30, r22",                      // 1: Z = the first
            "ldd r18, Z+{link}",                  // 2: the last leads to the second
            "ldd r19, Z+{link}+1",                // 2
            "adiw r26, {link}",                   // 2
            "st X+, r18",                         // 2
            "st X, r19",                          // 2
            "3:",
            "ldd r18, Y+{link}",                  // 2: the first goes behind the running task
            "ldd r19, Y+{link}+1",                // 2
            "std Z+{link}, r18",                  // 2
            "std Z+{link}+1, r19",                // 2
            "std Y+{link}, r30",                  // 2
            "std Y+{link}+1, r31",                // 2
            "5:",
            "sei",                                // 1
            "4:",
            "ret",                                // 4
            // It was the only one.
            "6:",
            "movw r26, r18",                      // 1
            "st X+, r1",                          // 2
            "st X, r1",                           // 2
            "inc r0",                             // 1: its bit in a set of priorities
            "com r0",                             // 1
            "lds r18, {kernel}+{arrived}",        // 2
            "and r18, r0",                        // 1
            "sts {kernel}+{arrived}, r18",        // 2
            "rjmp 3b",                            // 2
            // Puts who is behind the running task back to its queue, if it is of the same priority. It leaves r20 alone.
            ".global kernel_push",
            "kernel_push:",
            "cli",                                // 1
            "lds r26, {kernel}+{head}",           // 2: X = the running task
            "lds r27, {kernel}+{head}+1",         // 2
            "ld r18, X",                          // 2
            "adiw r26, {link}",                   // 2
            "ld r30, X+",                         // 2: Z = who is behind
            "ld r31, X",                          // 2
            "ld r19, Z",                          // 2
            "cp r18, r19",                        // 1
            "brne 2f",                            // 1, or 2
            "ldd r18, Z+{link}",                  // 2
            "ldd r19, Z+{link}+1",                // 2
            "st X, r19",                          // 2
            "st -X, r18",                         // 2
            "call kernel_queue_of",               // 4: X = where the last of its priority is
            "ld r18, X+",                         // 2
            "ld r19, X",                          // 2
            "tst r19",                            // 1
            "breq 1f",                            // 1: there is none
            "movw r26, r18",                      // 1
            "adiw r26, {link}",                   // 2
            "ld r18, X",                          // 2: that leads to it, and it to the first before
            "st X+, r30",                         // 2
            "ld r19, X",                          // 2
            "st X, r31",                          // 2
            "std Z+{link}, r18",                  // 2
            "std Z+{link}+1, r19",                // 2
            "rjmp 2f",                            // 2
            "1:",
            "call kernel_make_ready",             // 4
            "2:",
            "sei",                                // 1
            kernel = sym KERNEL,
            head = const HEAD,
            arrived = const ARRIVED,
            last = const LAST,
            walk = const WALK,
            link = const LINK,
            priority = const PRIORITY,
            end = const (link::END >> 8),
            flags = const offset_of!(Until, flags),
            least = const offset_of!(Until, least),
            blocked = const Came::Blocked as u8,
            signal = const Came::Signal as u8,
            until = const Came::Until as u8,
        )
    }
}
