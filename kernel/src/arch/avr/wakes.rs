//! What makes a task ready, and what follows for the running one.

use core::arch::asm;
use core::mem::offset_of;
use core::ptr;

use super::{ARRIVED, HEAD, LAST, LINK, PRIORITY, RUNNING};
use crate::KERNEL;
use crate::context::Task;
use crate::masked::Masked;
use crate::pool::{Pooled, Slot};
use crate::queue::{Appended, Queue};
use crate::semaphore::Semaphore;
use crate::task::{ControlBlock, Flag, SUSPENDED};

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

/// Saves the running task's context and takes up the head's; returns when this task runs again. It is a call, and preserves
/// what one does.
///
/// 117 cycles to a task that blocked likewise. If an interrupt has made the switch first, this one is to the task itself, and
/// comes back at once.
#[inline(always)]
pub(crate) fn switch_from_call() {
    // SAFETY: a task calls this, with interrupts enabled. It is a call.
    unsafe { kernel_switch_from_call() }
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

unsafe extern "C" {
    fn kernel_make_ready();
    fn kernel_arrive();
    fn kernel_post();
    fn kernel_switch_from_call();
}

/// Signals the semaphore Z. r24 = whether another task is to run now. What else a call may change is changed.
///
/// Interrupts are masked. They strike in between, where one waits that stands in for a task, unless r21 is 0.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".lowtext.kernel.wakes")]
#[inline(never)]
#[expect(
    named_asm_labels,
    reason = "other code jumps to them, and a function that is not inlined stands once"
)]
pub(super) unsafe extern "C" fn kernel_signal() {
    // SAFETY: interrupts are masked, and the lists become what they should.
    unsafe {
        asm!(
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
            "cpi r25, {suspended}",               // 1
            "breq 6f",                            // 1
            "7:",
            "lds r26, {kernel}+{head}",           // 2: X = the head
            "lds r27, {kernel}+{head}+1",         // 2
            "ld r24, X",                          // 2: the priorities above that
            "cp r25, r24",                        // 1
            "brsh 1f",                            // 1, or 2
            "std Z+{link}, r26",                  // 2: the task goes before the head
            "std Z+{link}+1, r27",                // 2
            "sts {kernel}+{head}, r30",           // 2
            "sts {kernel}+{head}+1, r31",         // 2
            "ldi r24, 1",                         // 1
            "ret",                                // 4
            // Makes the task Z ready, which stands in for no other. r24 as above.
            ".global kernel_make_ready",
            "kernel_make_ready:",
            "ld r25, Z",                          // 2
            "rjmp 7b",                            // 2
            // Nobody waits for the signal: it is stored. X is at the high byte of the semaphore's word r19:r18.
            ".global kernel_store_signal",
            "kernel_store_signal:",
            "breq 2f",                            // 2, or 1 where the last task that waited has left it empty
            "clr r18",                            // 1
            "2:",
            "inc r18",                            // 1
            "breq 3f",                            // 1: no more go in
            "st X, r1",                           // 2
            "st -X, r18",                         // 2
            "3:",
            "clr r24",                            // 1
            "ret",                                // 4
            // The task Z, first of those that waited, does not outrank the head. r24 as above.
            ".global kernel_arrive",
            "kernel_arrive:",
            "ld r25, Z",                          // 2
            "cpi r25, {suspended}",               // 1
            "brne 2f",                            // 2, or 1
            "6:",
            "ldd r25, Z+{priority}",              // 2
            "sbrs r25, {stands_in}",              // 1, or 2
            "rjmp 4f",                            // 2
            // It stands in for another task, in a program where one waits for several semaphores.
            ".weak kernel_stand_in",
            "jmp kernel_stand_in",                // 3
            "1:",
            "cpi r25, {suspended}",               // 1
            "brne 2f",                            // 2, or 1
            // It is suspended, and left until it is resumed.
            "4:",
            "ldi r24, lo8({parked})",             // 1
            "ldi r25, hi8({parked})",             // 1
            "std Z+{link}, r24",                  // 2
            "std Z+{link}+1, r25",                // 2
            "clr r24",                            // 1
            "ret",                                // 4
            // It joins those that have arrived at its priority.
            "2:",
            "ldd r26, Z+{priority}",              // 2: as below, without a call: interrupts may be masked for long
            "andi r26, 7",                        // 1
            "lsl r26",                            // 1
            "clr r27",                            // 1
            "subi r26, lo8(-({kernel}+{last}))",  // 1: X = where the last of these is
            "sbci r27, hi8(-({kernel}+{last}))",  // 1
            "ld r18, X+",                         // 2
            "ld r19, X",                          // 2
            "st X, r31",                          // 2: that is the task now
            "st -X, r30",                         // 2
            "tst r19",                            // 1
            "breq 5f",                            // 1: there was none
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
            "5:",
            "std Z+{link}, r30",                  // 2: a ring of one
            "std Z+{link}+1, r31",                // 2
            "inc r25",                            // 1: its bit in a set of priorities
            "lds r24, {kernel}+{arrived}",        // 2
            "or r24, r25",                        // 1
            "sts {kernel}+{arrived}, r24",        // 2
            "clr r24",                            // 1
            "ret",                                // 4
            // A task signals the semaphore Z. It preserves what a call does.
            ".global kernel_post",
            "kernel_post:",
            #[cfg(not(feature = "fault-unmasked-post"))]
            "cli",                                // 1
            "ldd r25, Z+1",                       // 2: the high byte of its word
            "tst r25",                            // 1
            "brne 2f",                            // 1: tasks wait, or the last has left it empty
            "ld r24, Z",                          // 2
            "inc r24",                            // 1
            "breq 3f",                            // 1: no more go in
            "st Z, r24",                          // 2
            "3:",
            "reti",                               // 4: and interrupts are enabled
            "2:",
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
            "rcall kernel_switch",                // 3
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
            // X = where the last is of those that have arrived at the priority of the task Z.
            ".global kernel_queue_of",
            "kernel_queue_of:",
            "ldd r26, Z+{priority}",              // 2
            "andi r26, 7",                        // 1
            "lsl r26",                            // 1
            "clr r27",                            // 1
            "subi r26, lo8(-({kernel}+{last}))",  // 1
            "sbci r27, hi8(-({kernel}+{last}))",  // 1
            kernel = sym KERNEL,
            head = const HEAD,
            running = const RUNNING,
            arrived = const ARRIVED,
            last = const LAST,
            link = const LINK,
            priority = const PRIORITY,
            suspended = const SUSPENDED,
            stands_in = const (Flag::StandsIn as u8).trailing_zeros(),
            parked = const crate::link::PARKED,
        )
    }
}
