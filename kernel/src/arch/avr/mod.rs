//! The classic AVR (ATmega128 datasheet, "AVR CPU Core").
//!
//! # Two kinds of context
//! A task blocks in a call that declares all registers but Y as clobbered, so the compiler saves only those
//! that it still needs. A *voluntary* context is therefore the return address and Y, which can't be declared
//! as clobbered: 4 bytes. An interrupt can occur at any instruction. A *preempted* context is therefore all
//! 32 registers, SREG and the program counter: 35 bytes. Bit 15 of the saved stack pointer, which no SRAM
//! address needs, is set for a preempted context.
//!
//! The program counter takes 2 bytes. On an MCU with more than 128 KB of flash (ATmega2560) it takes 3, so
//! each context there takes one byte more. Figures here are for 2. Function pointers are 16-bit word
//! addresses on all MCUs: for a function beyond 128 KB the linker inserts a stub.
//!
//! ```text
//!   voluntary: r28 r29 PC
//!   preempted: PC r31 r30 r0 SREG r1 r18..r27 r28 r29 | r2..r17
//! ```
//!
//! # Interrupts
//! An interrupt pushes the registers that a call may change and Y onto the stack that it finds (19 bytes with
//! the PC). It then moves to the kernel's stack, so that handlers need no space on a task's stack, and calls
//! the handler. An interrupt that finds the kernel's stack in use stays on it. Only if another task became
//! the head does it save the other 16 registers, and resumes that task's context instead.
//!
//! These 16 registers are saved and loaded through a pointer, with SP at the top of the kernel's stack and
//! interrupts enabled: an interrupt that occurs meanwhile pushes nothing onto a task's stack. If it preempts
//! a save, the save continues and then resumes the present head. If it preempts a load, the switch restarts
//! with the present head.
//!
//! # Stacks
//! The kernel's stack is the one that `main` started on: from the top of SRAM down to the end of `.bss`. The
//! idle task has no state: it starts over each time, with that stack empty.
//!
//! On an MCU that has RAMPZ, it is part of a preempted context. Its bit 0 lies in bit 7 of the saved SREG,
//! which is clear in every interrupt. Where RAMPZ has two bits (ATmega2560), bit 7 of SREG tells whether
//! either is set, and the two lie in the upper half of the program counter's third byte. A voluntary context
//! does not save RAMPZ: set it again after a call that may block.
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

#[cfg(not(target_feature = "jmpcall"))]
compile_error!("the kernel needs an AVR with the instructions JMP and CALL: name another with -Ctarget-cpu");
// The XMEGA and later AVRs end an interrupt by RETI alone. The kernel leaves it by `ret`.
#[cfg(target_feature = "lowbytefirst")]
compile_error!("the kernel is for classic AVRs, and this is none: name another with -Ctarget-cpu");

/// Bytes of a return address. An MCU has `eijmp` if it needs 3.
const PROGRAM_COUNTER: usize = if cfg!(target_feature = "eijmpcall") { 3 } else { 2 };

/// Bytes that an interrupt pushes before it calls its handler.
const FRAME: usize = 17 + PROGRAM_COUNTER;

/// Marked as preempted, with address 0, which leads the switch to the idle loop.
pub(crate) const IDLE_CONTEXT: usize = 0x8000;

/// The addresses of RAM begin at 0x100 and end below 0x8000.
pub(crate) const LINK_MARK: usize = 0;

#[cfg(feature = "cpu-time")]
unsafe extern "C" {
    /// Its address is that of the clock's counter: see [`clock_interrupts!`](crate::clock_interrupts!).
    static kernel_clock: [u8; 2];
}

/// The count of the clock that measures tasks' CPU times.
#[cfg(feature = "cpu-time")]
#[inline(always)]
pub(crate) fn clock(_: &Masked) -> u16 {
    let low = (&raw const kernel_clock).cast::<u8>();
    // SAFETY: a 16-bit register. Reading its low byte latches the high one (ATmega128 datasheet, "Accessing
    // 16-bit Registers"), and interrupts are masked.
    u16::from_le_bytes(unsafe { [low.read_volatile(), low.add(1).read_volatile()] })
}
