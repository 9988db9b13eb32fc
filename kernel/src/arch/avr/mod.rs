//! The classic AVR (ATmega128 datasheet, "AVR CPU Core").
//!
//! # Two kinds of context
//! A task that blocks does so at a place the compiler knows: a call that tells it that every register is
//! lost there, and the compiler keeps what it needs, no more. So a *voluntary* context is the return address
//! and Y, which can't be declared lost: 4 bytes. An interrupt occurs anywhere: its *preempted* context is
//! all 32 registers, SREG and the program counter, 35 bytes. Bit 15 of the saved stack pointer, which no
//! SRAM address needs, tells which it is.
//!
//! The program counter takes 2 bytes, and 3 on an MCU with more than 128 KB of flash (ATmega2560): there each
//! context takes one more. Figures here are for 2. Addresses of functions are words in 16 bits everywhere: to
//! those beyond 128 KB the linker leads by a stub.
//!
//! ```text
//!   voluntary: r28 r29 PC
//!   preempted: PC r31 r30 r0 SREG r1 r18..r27 r28 r29 | r2..r17
//! ```
//!
//! # Interrupts
//! An interrupt pushes what a call may change and Y onto the stack it found (19 bytes with the PC), then
//! moves to the kernel's stack, so that handlers cost no task any stack, and calls the handler. Where it
//! finds the kernel's stack it stays there. Only if a task became the head are the other 16 registers saved,
//! and that task's context is resumed instead.
//!
//! Those 16 registers are saved and loaded through a pointer, with SP at the top of the kernel's stack and
//! interrupts enabled: one that occurs there lays nothing onto a task's stack. It leaves the switch to what
//! it preempted, or begins it anew.
//!
//! # Stacks
//! The kernel's stack is what `main` started on: the top of SRAM, growing down to the end of `.bss`. The idle
//! task has nothing to remember: it begins anew each time, with that stack empty.
//!
//! RAMPZ, on an MCU that has it, is part of a preempted context: its bit 0 lies in bit 7 of SREG, which every
//! interrupt finds clear. Where it has two bits (ATmega2560), that one tells whether any is set, and they lie
//! in the upper half of the program counter's third byte. A voluntary context does not keep it: set it anew
//! after a call that may block.
//!
//! Cycle counts in the comments are those of the instruction beside them.

mod flash;
mod interrupts;
#[cfg(feature = "stack-check")]
mod stack_check;
mod start;
mod switch;
mod vectors;

pub(crate) use flash::load;
pub(crate) use interrupts::{critical, disable_interrupts, enable_interrupts, irq_window, isr_window};
pub(crate) use start::{begin, fits, init_context, may_block, need_tick, run_head, stack, when_dropped};
#[doc(hidden)]
pub use switch::{RUNNING, kernel_enter_interrupt, kernel_enter_with_status};
pub(crate) use switch::{switch, switch_from_call};
#[doc(hidden)]
pub use vectors::vector_number;

#[cfg(feature = "cpu-time")]
use crate::critical::Masked;

/// Bytes of a return address. An MCU has `eijmp` if it needs 3.
const PROGRAM_COUNTER: usize = if cfg!(target_feature = "eijmpcall") { 3 } else { 2 };

/// Bytes that an interrupt pushes before it calls its handler.
const FRAME: usize = 17 + PROGRAM_COUNTER;

/// Marked as preempted: that leads to where the idle task begins.
pub(crate) const IDLE_CONTEXT: usize = 0x8000;

/// The addresses of RAM begin at 0x100 and end below 0x8000.
pub(crate) const LINK_MARK: usize = 0;

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
    // SAFETY: a register of two bytes. Reading the low one keeps the high one as it was then (ATmega128
    // datasheet, "Accessing 16-bit Registers"), and interrupts are masked.
    u16::from_le_bytes(unsafe { [low.read_volatile(), low.add(1).read_volatile()] })
}
