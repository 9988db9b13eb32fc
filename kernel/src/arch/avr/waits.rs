//! Waits, and yields. A task that is not the first to wait goes by priority along the list of those that do, with interrupts
//! enabled after each step: see [`walk`](crate::walk).
//!
//! On the host [`Semaphore`] and `ready` do the same in Rust.

use core::arch::asm;
use core::mem::{MaybeUninit, offset_of};
use core::ptr;

use super::{ARRIVED, HEAD, LINK, PRIORITY, RUNNING, WALK};
use crate::context::Task;
use crate::link;
use crate::semaphore::{Came, Semaphore, Until};
use crate::task::ControlBlock;
use crate::{KERNEL, SCHEDULER};

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

/// Takes a signal of `semaphore`, and blocks until there is one. 95 cycles to a task that blocked likewise, where none else waits.
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

unsafe extern "C" {
    fn kernel_enter(semaphore: &Semaphore, own: &ControlBlock, until: Option<&Until>) -> Came;
    fn kernel_yield();
}

/// The running task waits at the semaphore Z; in the commonest case there are neither signals nor other tasks. All registers
/// but Y are lost.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".lowtext.kernel.waits")]
#[inline(never)]
#[expect(
    named_asm_labels,
    reason = "other code jumps to them, and a function that is not inlined stands once"
)]
unsafe extern "C" fn kernel_wait() {
    // SAFETY: a task calls this, with interrupts enabled.
    unsafe {
        asm!(
            "push r28",                           // 2: as for a switch
            "push r29",                           // 2
            "movw r24, r30",                      // 1: r25:r24 = the semaphore
            "movw r26, r30",                      // 1: X, too
            "cli",                                // 1
            "ldd r18, Z+1",                       // 2: the high byte of its word
            "tst r18",                            // 1
            "brmi 1f",                            // 2, or 1: it was left empty by who waited last
            "ld r19, Z",                          // 2
            "or r18, r19",                        // 1
            "brne 2f",                            // 1, or 2: there are signals, or tasks
            "1:",
            "rcall kernel_leave_head",            // 34 at most: Y = the running task
            "ori r25, {end}",                     // 1: the end of the semaphore's list
            "std Y+{link}, r24",                  // 2: is the task's link,
            "std Y+{link}+1, r25",                // 2
            "st X+, r28",                         // 2: and its beginning is the task
            "st X, r29",                          // 2
            "movw r30, r28",                      // 1
            "sei",                                // 1: a trap finds the task that has blocked still running
            "rjmp kernel_save",                   // 2
            "2:",
            "sei",                                // 1
            "lds r28, {kernel}+{running}",        // 2: Y = the running task
            "lds r29, {kernel}+{running}+1",      // 2
            "clr r21",                            // 1: nothing else ends the wait
            "rcall enter_list",                   // 3: r24 = whether it has not blocked
            "movw r30, r28",                      // 1
            "cpse r24, r1",                       // 1, or 2 where it has
            "rjmp return_to_task",                // 2
            "rjmp kernel_save",                   // 2
            // Takes the head, which is the running task, from those that are ready: Y. The next is the head then; or the scheduler,
            // where a task that has arrived outranks the next. Interrupts are masked. It changes r18, r19, r22, r23 and Z.
            ".global kernel_leave_head",
            "kernel_leave_head:",
            "lds r28, {kernel}+{head}",           // 2
            "lds r29, {kernel}+{head}+1",         // 2
            // The same where Y is that already.
            "leave_head:",
            "ldd r22, Y+{link}",                  // 2: r23:r22 = the next one
            "ldd r23, Y+{link}+1",                // 2
            "movw r30, r22",                      // 1
            "ld r18, Z",                          // 2: the priorities above that
            "lds r19, {kernel}+{arrived}",        // 2
            "and r18, r19",                       // 1
            "breq 3f",                            // 2, or 1
            "ldi r30, lo8({scheduler})",          // 1
            "ldi r31, hi8({scheduler})",          // 1
            "std Z+{link}, r22",                  // 2
            "std Z+{link}+1, r23",                // 2
            "3:",
            "sts {kernel}+{head}, r30",           // 2
            "sts {kernel}+{head}+1, r31",         // 2
            "sts {kernel}+{walk}, r1",            // 2: ends a walk
            "ret",                                // 4
            // Has Y wait at the semaphore r25:r24, unless what r21:r20 points to has come, if r21 is not 0. r24 = what came. It
            // preserves what a call does.
            "enter_list:",
            "ld r22, Y",                          // 2
            "bst r22, 7",                         // 1: T = whether it stands in for a task, as what is suspended
            "clr r19",                            // 1: r19:r18 = who was first when the walk began: nobody
            "1:",
            "cli",                                // 1
            "movw r30, r24",                      // 1
            "ld r22, Z",                          // 2: r23:r22 = the semaphore's word
            "ldd r23, Z+1",                       // 2
            "tst r23",                            // 1
            "brmi 3f",                            // 1: it was left empty
            "breq 2f",                            // 1, or 2: it is a number
            "cp r22, r18",                        // 1: tasks wait: is the first the same,
            "cpc r23, r19",                       // 1
            "brne 3f",                            // 1
            "lds r30, {kernel}+{walk}",           // 2: and does the walk go on?
            "cpse r30, r1",                       // 1, or 2 where it does not
            "rjmp 5f",                            // 2
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
            "movw r20, r30",                      // 1
            "brts 9f",                            // 1: who is to wait stands in for a task
            "rcall leave_head",                   // 30 at most
            "10:",
            "std Y+{link}, r20",                  // 2
            "std Y+{link}+1, r21",                // 2
            "st X, r29",                          // 2
            "st -X, r28",                         // 2
            "ldi r24, {blocked}",                 // 1
            "sei",                                // 1
            "ret",                                // 4
            "9:",
            "sts {kernel}+{walk}, r1",            // 2: ends a walk
            "rjmp 10b",                           // 2
            "2:",
            "subi r22, 1",                        // 1
            "brcs 3b",                            // 1: there is no signal
            "st Z, r22",                          // 2: one less
            "ldi r24, {signal}",                  // 1
            "rjmp 8f",                            // 2
            "7:",
            "ldi r24, {until}",                   // 1
            "8:",
            "sei",                                // 1
            "ret",                                // 4
            // The same for Rust, with r23:r22 instead of Y.
            ".global kernel_enter",
            "kernel_enter:",
            "push r28",                           // 2
            "push r29",                           // 2
            "movw r28, r22",                      // 1
            "rcall enter_list",                   // 3
            "pop r29",                            // 2
            "pop r28",                            // 2
            "ret",                                // 4
            // Lets the first task that has arrived at the running one's priority run. All registers but Y are lost.
            ".global kernel_yield",
            "kernel_yield:",
            "lds r30, {kernel}+{running}",        // 2: Z = the running task
            "lds r31, {kernel}+{running}+1",      // 2
            "rcall kernel_queue_of",              // 15: X = where the last of its priority is
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
            "rjmp kernel_switch",                 // 2
            "1:",
            "sei",                                // 1
            kernel = sym KERNEL,
            scheduler = sym SCHEDULER,
            head = const HEAD,
            running = const RUNNING,
            arrived = const ARRIVED,
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
