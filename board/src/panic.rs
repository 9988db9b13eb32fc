//! Records of panics for the next start, for programs that can panic.
//!
//! ```ignore
//! #[panic_handler]
//! fn panic(info: &core::panic::PanicInfo) -> ! {
//!     board::panic::record_and_reset(info)
//! }
//! ```
//!
//! The record lies in SRAM that the start-up code does not initialize: it survives every reset except a loss
//! of power. `Board::reset_cause` tells why the MCU started: after a panic it is the watchdog.

use core::arch::{asm, global_asm};
use core::panic::PanicInfo;

use kernel::{Boot, Context, Interrupt};

use crate::watchdog::{self, Patience};

/// The place of a panic.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct PanicRecord {
    /// The address of the `Stack` of the task that ran, as in the linker's map. In a handler, that of the
    /// task that it interrupted; before any task ran, that of the kernel's idle task.
    pub task: u16,
    /// Line in the source, up to 65,535. 0 means that there was no panic, but the task has overflowed its
    /// stack.
    pub line: u16,
    /// Column in that line, up to 65,535.
    pub column: u16,
}

// In assembly, because a Rust static in this section would be loaded with the image.
global_asm!(r#".section .noinit, "aw", @nobits"#, ".global board_panic", "board_panic: .skip 8", ".previous",);

unsafe extern "C" {
    /// A [`PanicRecord`] and its checksum.
    #[link_name = "board_panic"]
    static mut RECORD: [u16; 4];
}

/// Records the place of the panic, and lets the watchdog reset the MCU, which takes about 14 ms. Interrupts
/// are masked from here on.
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

/// Writes the record and lets the watchdog reset the MCU. Interrupts must be masked.
fn record(PanicRecord { task, line, column }: PanicRecord) -> ! {
    let record = &raw mut RECORD;
    // SAFETY: nothing else runs. Volatile, because it is read after a reset.
    unsafe { record.write_volatile([task, line, column, checksum([task, line, column])]) };
    // SAFETY: interrupts are masked.
    unsafe { watchdog::start(Patience::Shortest) };
    loop {}
}

/// Takes the record of the last panic: `None` if there was no panic since it was last taken.
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

/// Random values at power-up match it once in 65,536 times.
fn checksum(words: [u16; 3]) -> u16 {
    words.into_iter().fold(0x5a5a, |sum: u16, word| sum.rotate_left(5).wrapping_add(word))
}
