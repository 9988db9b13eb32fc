//! What a panic leaves for the next start, for programs that can panic.
//!
//! ```ignore
//! #[panic_handler]
//! fn panic(info: &core::panic::PanicInfo) -> ! {
//!     board::panic::record_and_reset(info)
//! }
//! ```
//!
//! The record lies in SRAM that the start-up code leaves alone: every reset keeps it but one by a loss of
//! power. What the MCU started from is `Board::reset_cause`, after a panic the watchdog.

use core::arch::{asm, global_asm};
use core::panic::PanicInfo;

use kernel::{Boot, Context, Interrupt};

use crate::watchdog::{self, Patience};

/// Where a panic was.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct PanicRecord {
    /// The address of the `Stack` of the task that ran, as the linker's map has it; in a handler, of the task
    /// that it interrupted; before any task ran, of the kernel's idle task.
    pub task: u16,
    /// Line in the source, up to 65,535. 0: no panic, but the task has overflowed its stack.
    pub line: u16,
    /// Column in that line, likewise.
    pub column: u16,
}

// In assembly, because a Rust static in this section would be loaded with the image.
global_asm!(r#".section .noinit, "aw", @nobits"#, ".global board_panic", "board_panic: .skip 8", ".previous",);

unsafe extern "C" {
    /// A [`PanicRecord`] and its checksum.
    #[link_name = "board_panic"]
    static mut RECORD: [u16; 4];
}

/// Records where the panic was, and has the watchdog reset the MCU, which takes about 14 ms. Interrupts are
/// masked.
pub fn record_and_reset(info: &PanicInfo) -> ! {
    // SAFETY: nothing else runs from here on.
    unsafe { asm!("cli", options(nomem, nostack)) };
    // SAFETY: interrupts are masked, as in a handler, and nothing here switches.
    let task = unsafe { Interrupt::assume() }.mask(kernel::running);
    let (line, column) = info.location().map_or((0, 0), |location| (location.line(), location.column()));
    let shorten = |number| u16::try_from(number).unwrap_or(u16::MAX);
    record(PanicRecord { task: task as u16, line: shorten(line), column: shorten(column) })
}

/// Records that the task on the stack at that address has overflowed it, and resets as
/// [`record_and_reset`] does. For [`kernel::stack_overflow!`], in a program with the kernel's feature
/// `stack-check`.
pub fn record_overflow_and_reset(stack: usize) -> ! {
    // SAFETY: nothing else runs from here on.
    unsafe { asm!("cli", options(nomem, nostack)) };
    record(PanicRecord { task: stack as u16, line: 0, column: 0 })
}

/// Leaves a record and has the watchdog reset the MCU. Interrupts are masked.
fn record(PanicRecord { task, line, column }: PanicRecord) -> ! {
    let record = &raw mut RECORD;
    // SAFETY: nothing else runs. Volatile, because it is read after a reset.
    unsafe { record.write_volatile([task, line, column, checksum([task, line, column])]) };
    // SAFETY: interrupts are masked.
    unsafe { watchdog::start(Patience::Shortest) };
    loop {}
}

/// What the last panic left, once: `None` when there was none since it was last asked for.
pub fn take(_: &mut Boot) -> Option<PanicRecord> {
    let record = &raw mut RECORD;
    // SAFETY: no task runs yet, so nothing else uses it. Volatile, because it holds what was there before the
    // program started.
    let [task, line, column, sum] = unsafe { record.read_volatile() };
    if sum != checksum([task, line, column]) {
        return None;
    }
    // SAFETY: no task runs before `Boot` is over, so nothing else uses the record.
    unsafe { record.write_volatile([task, line, column, !sum]) };
    Some(PanicRecord { task, line, column })
}

/// Chance values at power-up fit it one time in 65,536.
fn checksum(words: [u16; 3]) -> u16 {
    words.into_iter().fold(0x5a5a, |sum: u16, word| sum.rotate_left(5).wrapping_add(word))
}
