//! What tasks do to tasks: they are searched, taken out of the middle of a list by steps with interrupts enabled in between (see
//! [`walk`](crate::walk)), and let go on.
//!
//! On the host `list` does the same in Rust.

use core::arch::asm;

use super::{ARRIVED, HEAD, LINK, PRIORITY, STACK_POINTER, WALK};
use crate::KERNEL;
use crate::context::{Private, ThreadContext};
use crate::link;
use crate::list::{Found, Suspension};
use crate::masked::Masked;
use crate::ready;
use crate::task::{self, ControlBlock, Flag, Priority};

/// Searches `task` among those that are ready. Unless it is refused or suspended before, takes it from there and suspends it, as
/// `suspension` says; and does `then`, all in one masked section. It is not the running one then.
///
/// Linear in the number of ready tasks, in steps.
#[inline(always)]
pub(crate) fn search<R>(
    context: &mut impl ThreadContext,
    task: &'static ControlBlock,
    suspension: Suspension,
    then: impl FnOnce(&Masked, Found) -> R,
) -> R {
    let suspension = u16::from_le_bytes([suspension.unless, suspension.flag]);
    let between = status_between(context);
    context.mask(|masked| {
        // SAFETY: interrupts are masked, and the lists become what they should.
        let found = unsafe { kernel_search(task, suspension, between) };
        if between == 0 {
            // No task runs, so it may have been the head.
            ready::put_head(masked, KERNEL.ready.head.get(masked));
        }
        then(masked, found)
    })
}

/// Takes `task`, which is held, from those that wait for a semaphore, if it does.
///
/// Linear in the number of tasks that wait for the same, in steps.
#[inline(always)]
pub(crate) fn withdraw(context: &mut impl ThreadContext, task: &'static ControlBlock) {
    let between = status_between(context);
    // SAFETY: interrupts are masked, and the lists become what they should.
    context.mask(|_| unsafe { kernel_withdraw(task, between) });
}

/// Lets `task` run again, unless it was not suspended, or is held: `None`. Returns whether it is now the one to run.
#[inline(always)]
pub(crate) fn resume(_: &Masked, task: &'static ControlBlock) -> Option<bool> {
    // SAFETY: as above.
    match unsafe { kernel_resume(task) } {
        NOT_RESUMED => None,
        is_due => Some(is_due != 0),
    }
}

/// Lets `task` run again, which was suspended, with `priority`, that the set `above` goes before. Returns whether it is now the one
/// to run.
#[inline(always)]
pub(crate) fn release(_: &Masked, task: &'static ControlBlock, priority: Priority, above: u8) -> bool {
    // SAFETY: as above.
    unsafe { kernel_release(task, priority, above) != 0 }
}

const NOT_RESUMED: u8 = 2;

/// SREG between two steps: interrupts strike, unless no task runs yet.
#[inline(always)]
fn status_between(context: &mut impl ThreadContext) -> u8 {
    if context.task(Private).is_some() { 0x80 } else { 0 }
}

unsafe extern "C" {
    fn kernel_search(task: &ControlBlock, suspension: u16, between: u8) -> Found;
    fn kernel_withdraw(task: &ControlBlock, between: u8);
    fn kernel_resume(task: &ControlBlock) -> u8;
    fn kernel_release(task: &ControlBlock, priority: Priority, above: u8) -> u8;
}

/// Searches the task r25:r24, and suspends it with the flag r23, unless one of the flags r22 is set; if r22 is 0 it only looks.
/// r24 = what is found. r20 is SREG between two steps. Interrupts are masked before and after.
#[unsafe(no_mangle)]
#[inline(never)]
#[expect(named_asm_labels, reason = "Rust calls it by that, and a function that is not inlined stands once")]
unsafe extern "C" fn kernel_search_ready() {
    // SAFETY: a task calls this, or none runs yet.
    unsafe {
        asm!(
            ".global kernel_search",
            "kernel_search:",
            "1:",
            "movw r30, r24",                      // 1: Z = the task
            "ldi r24, {not_started}",             // 1
            "ldd r18, Z+{sp}+1",                  // 2
            "tst r18",                            // 1
            "breq 10f",                           // 1
            "ldi r24, {refused}",                 // 1
            "ldd r18, Z+{priority}",              // 2
            "and r18, r22",                       // 1
            "brne 10f",                           // 1
            "ldi r24, {suspended}",               // 1
            "ld r18, Z",                          // 2
            "cpi r18, {nothing_less}",            // 1
            "breq 10f",                           // 1
            "movw r24, r30",                      // 1
            "ldi r18, 1",                         // 1
            "sts {kernel}+{walk}, r18",           // 2: begins a walk
            "call kernel_queue_of",               // 4
            "movw r30, r26",                      // 1: Z = where the last of its priority is
            "ldi r26, lo8({kernel}+{head})",      // 1: X = what leads to the next
            "ldi r27, hi8({kernel}+{head})",      // 1
            "2:",
            "out 0x3f, r20",                      // 1: takes effect after the next instruction
            "nop",                                // 1
            "cli",                                // 1
            "lds r18, {kernel}+{walk}",           // 2
            "tst r18",                            // 1: does the walk go on?
            "breq 1b",                            // 1
            "ld r0, Z",                           // 2: r21:r0 = the last that has arrived, if there is one
            "ldd r21, Z+1",                       // 2
            "tst r27",                            // 1
            "brne 3f",                            // 1: not behind the idle task
            "tst r21",                            // 1
            "breq 4f",                            // 1
            "mov r26, r0",                        // 1: on with the first that has arrived
            "mov r27, r21",                       // 1
            "adiw r26, {link}",                   // 2
            "3:",
            "ld r18, X+",                         // 2: r19:r18 = the next
            "ld r19, X",                          // 2
            "cp r18, r24",                        // 1
            "cpc r19, r25",                       // 1
            "breq 5f",                            // 1: the task
            "cp r18, r0",                         // 1
            "cpc r19, r21",                       // 1
            "breq 4f",                            // 1: the last
            "movw r26, r18",                      // 1
            "adiw r26, {link}",                   // 2
            "rjmp 2b",                            // 2
            // It is not ready.
            "4:",
            "movw r30, r24",                      // 1
            "ldi r24, {waiting}",                 // 1
            "tst r22",                            // 1
            "brne 9f",                            // 1, or 2
            "10:",
            "sts {kernel}+{walk}, r1",            // 2: ends a walk
            "ret",                                // 4
            "11:",
            "ldi r24, {ready}",                   // 1
            "rjmp 10b",                           // 2
            // It is, and X = the high byte of what leads to it.
            "5:",
            "tst r22",                            // 1
            "breq 11b",                           // 1
            "movw r18, r30",                      // 1
            "movw r30, r24",                      // 1
            "ldd r20, Z+{link}",                  // 2
            "ldd r22, Z+{link}+1",                // 2
            "cp r20, r24",                        // 1
            "cpc r22, r25",                       // 1
            "breq 6f",                            // 1: a ring of one
            "st X, r22",                          // 2
            "st -X, r20",                         // 2
            "cp r0, r24",                         // 1
            "cpc r21, r25",                       // 1
            "brne 8f",                            // 1
            "sbiw r26, {link}",                   // 2: the last is now the one before
            "rjmp 7f",                            // 2
            "6:",
            "ld r20, Z",                          // 2
            "inc r20",                            // 1: its bit in a set of priorities
            "com r20",                            // 1
            "lds r21, {kernel}+{arrived}",        // 2
            "and r20, r21",                       // 1
            "sts {kernel}+{arrived}, r20",        // 2
            "clr r26",                            // 1
            "clr r27",                            // 1
            "7:",
            "movw r30, r18",                      // 1
            "st Z, r26",                          // 2
            "std Z+1, r27",                       // 2
            "movw r30, r24",                      // 1
            "8:",
            "ldi r18, hi8({parked})",             // 1
            "std Z+{link}, r1",                   // 2
            "std Z+{link}+1, r18",                // 2
            "ldi r24, {ready}",                   // 1
            "9:",
            "ldi r18, {nothing_less}",            // 1
            "st Z, r18",                          // 2
            "ldd r18, Z+{priority}",              // 2
            "or r18, r23",                        // 1
            "std Z+{priority}, r18",              // 2
            "sts {kernel}+{walk}, r1",            // 2
            kernel = sym KERNEL,
            head = const HEAD,
            arrived = const ARRIVED,
            walk = const WALK,
            link = const LINK,
            priority = const PRIORITY,
            sp = const STACK_POINTER,
            parked = const link::PARKED,
            nothing_less = const task::SUSPENDED,
            not_started = const Found::NotStarted as u8,
            ready = const Found::Ready as u8,
            waiting = const Found::Waiting as u8,
            suspended = const Found::Suspended as u8,
            refused = const Found::Refused as u8,
        )
    }
}

/// Takes the task r25:r24 from those that wait for a semaphore. r22 is SREG between two steps. Interrupts are masked before and
/// after.
#[unsafe(no_mangle)]
#[inline(never)]
#[expect(named_asm_labels, reason = "Rust calls it by that, and a function that is not inlined stands once")]
unsafe extern "C" fn kernel_withdraw_waiting() {
    // SAFETY: as above.
    unsafe {
        asm!(
            ".global kernel_withdraw",
            "kernel_withdraw:",
            "movw r30, r24",                      // 1: Z = the task
            // To the semaphore at the end of the list, first.
            "1:",
            "movw r24, r30",                      // 1
            "adiw r24, {link}",                   // 2: r25:r24 = where the walk begins
            "2:",
            "ldi r18, 1",                         // 1
            "sts {kernel}+{walk}, r18",           // 2
            "movw r26, r24",                      // 1: X = what leads to the next
            "ld r20, X+",                         // 2: r21:r20 = the first
            "ld r21, X",                          // 2
            "sbiw r26, 1",                        // 2
            "3:",
            "out 0x3f, r22",                      // 1: takes effect after the next instruction
            "nop",                                // 1
            "cli",                                // 1
            "lds r18, {kernel}+{walk}",           // 2
            "tst r18",                            // 1: does the walk go on?
            "breq 1b",                            // 1
            "movw r18, r26",                      // 1
            "movw r26, r24",                      // 1
            "ld r0, X+",                          // 2: interrupts wake the first
            "cp r0, r20",                         // 1
            "ld r0, X",                           // 2
            "cpc r0, r21",                        // 1
            "brne 1b",                            // 1
            "movw r26, r18",                      // 1
            "ld r18, X+",                         // 2: r19:r18 = the next
            "ld r19, X",                          // 2
            "cp r18, r30",                        // 1
            "cpc r19, r31",                       // 1
            "breq 5f",                            // 1: the task
            "tst r19",                            // 1
            "brmi 4f",                            // 1: the end of the list
            "movw r26, r18",                      // 1
            "adiw r26, {link}",                   // 2
            "rjmp 3b",                            // 2
            "4:",
            "cpi r19, hi8({parked})",             // 1
            "brsh 6f",                            // 1: it waits for no semaphore, or no more
            "andi r19, 0x7f",                     // 1
            "movw r24, r18",                      // 1: from the semaphore to the task, then
            "rjmp 2b",                            // 2
            "5:",
            "ldd r18, Z+{link}",                  // 2
            "ldd r19, Z+{link}+1",                // 2
            "st X, r19",                          // 2
            "st -X, r18",                         // 2
            "ldi r18, hi8({parked})",             // 1
            "std Z+{link}, r1",                   // 2
            "std Z+{link}+1, r18",                // 2
            "6:",
            "sts {kernel}+{walk}, r1",            // 2: ends a walk
            kernel = sym KERNEL,
            walk = const WALK,
            link = const LINK,
            parked = const link::PARKED,
        )
    }
}

/// Lets the task r25:r24 run again with the priority r22, below those in r20. It was suspended, and perhaps held. r24 = whether it is
/// now the one to run. Interrupts are masked.
#[unsafe(no_mangle)]
#[inline(never)]
#[expect(named_asm_labels, reason = "Rust calls it by that, and a function that is not inlined stands once")]
unsafe extern "C" fn kernel_release_suspended() {
    // SAFETY: whoever calls has masked interrupts.
    unsafe {
        asm!(
            ".global kernel_release",
            "kernel_release:",
            "movw r30, r24",                      // 1: Z = the task
            "ldd r18, Z+{priority}",              // 2
            "andi r18, {others}",                 // 1: not held
            "or r18, r22",                        // 1
            "std Z+{priority}, r18",              // 2
            "rjmp 1f",                            // 2
            // The same with its own priority, unless it was not suspended, or is held.
            ".global kernel_resume",
            "kernel_resume:",
            "movw r30, r24",                      // 1
            "ld r18, Z",                          // 2
            "cpi r18, {suspended}",               // 1
            "brne 3f",                            // 1
            "ldd r18, Z+{priority}",              // 2
            "sbrc r18, {held}",                   // 2
            "rjmp 3f",                            // 2
            "ldi r20, 1",                         // 1: r20 = its bit in a set of priorities
            "sbrc r18, 1",                        // 1, or 2
            "ldi r20, 4",                         // 1
            "sbrc r18, 0",                        // 1, or 2
            "lsl r20",                            // 1
            "sbrc r18, 2",                        // 1, or 2
            "swap r20",                           // 1
            "dec r20",                            // 1: the priorities above
            "1:",
            "st Z, r20",                          // 2
            "ldd r18, Z+{link}+1",                // 2
            "cpi r18, hi8({parked})",             // 1
            "brne 2f",                            // 1: it still waits
            "jmp kernel_make_ready",              // 3
            "2:",
            "clr r24",                            // 1
            "ret",                                // 4
            "3:",
            "ldi r24, {not}",                     // 1
            not = const NOT_RESUMED,
            suspended = const task::SUSPENDED,
            held = const (Flag::Held as u8).trailing_zeros(),
            others = const !(Flag::Held as u8 | 7),
            priority = const PRIORITY,
            link = const LINK,
            parked = const link::PARKED,
        )
    }
}

const _: () = assert!(link::PARKED & 0xff == 0);
