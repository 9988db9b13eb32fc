//! The classic AVR (ATmega128 datasheet, "AVR CPU Core").
//!
//! # Two kinds of context
//! A task that blocks does so at a place the compiler knows: a call that tells it that every register is
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
//! Those 16 registers are saved and loaded through a pointer, with SP on the idle task's stack and interrupts enabled: one
//! that strikes there lays nothing onto a task's stack. It finds that the head is not the running task, as it did before, but
//! sees by SP that it has struck the kernel, and leaves the switch to that.
//!
//! # Stacks
//! The kernel's stack is what `main` started on: the top of SRAM, growing down to the end of `.bss`. Its
//! first [`IDLE_STACK`] bytes are the idle task's, which has nothing to remember: it is begun anew each time. So its stack also
//! serves where the kernel has interrupts enabled: to save and load contexts, for the scheduler, and for the expiry of timers.
//!
//! RAMPZ, on an MCU that has it, is part of a preempted context: its bit 0 lies in bit 7 of SREG, which every interrupt finds
//! clear. Where it has two bits (ATmega2560), that one tells whether any is set, and they lie in the upper half of the
//! program counter's third byte. A voluntary context does not keep it: set it anew after a call that may block.
//!
//! Cycle counts in the comments are those of the instruction beside them.

mod control;
mod expiry;
mod stand_in;
mod start;
mod switch;
mod timers;
mod vectors;
mod waits;
mod wakes;

pub(crate) use control::{release, resume, search, withdraw};
pub(crate) use start::{Laid, fits, lay_body, lay_context, leave, run, stack};
#[doc(hidden)]
pub use switch::{kernel_enter_interrupt, kernel_enter_with_status, kernel_expire};
pub(crate) use timers::{arm, delay_until, disarm, disarm_within};
pub(crate) use waits::{enter_list, wait, yield_now};
pub(crate) use wakes::{append, arrive, make_ready, post, signal, switch_from_call};

use core::arch::asm;
use core::mem::offset_of;

use crate::group::{Group, StandIn};
use crate::masked::Masked;
use crate::task::ControlBlock;
use crate::timeout::Timeout;
use crate::timer::Timer;
use crate::{KERNEL, Kernel};

/// Bytes of a return address. An MCU has `eijmp` if it needs 3.
const PROGRAM_COUNTER: usize = if cfg!(target_feature = "eijmpcall") { 3 } else { 2 };

/// Bytes that an interrupt pushes before it moves to the kernel's stack.
const FRAME: usize = 17 + PROGRAM_COUNTER;

/// Bytes at the top of the kernel's stack that are the idle task's: what an interrupt pushes, the expiry of timers, and what
/// another interrupt pushes that strikes that.
const IDLE_STACK: usize = 52 + 6 * PROGRAM_COUNTER;

/// The stack pointers of the control blocks that are no tasks: marked as preempted, which leads to where they begin anew.
pub(crate) const IDLE_CONTEXT: usize = 0x8000;
pub(crate) const SCHEDULER_CONTEXT: usize = 0x8001;

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
