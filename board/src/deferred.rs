//! Vectors that do not enter the kernel, and the interrupt to which they hand over work that needs it.
//!
//! A handler of [`kernel::interrupt!`] may call the kernel, at a cost of some 120 cycles: it saves all
//! registers that a call may change, and changes the stack. A byte in the middle of a frame does not need the
//! kernel. The vectors that occur for each byte or edge are therefore Rust functions with the ABI
//! `avr-interrupt`: the compiler saves the registers that they use, and no more. To wake a task they raise a
//! software interrupt, which posts.
//!
//! That interrupt is "Store Program Memory Ready". It is pending as long as it is enabled, since no program
//! here writes its own flash, and all others have priority over it (ATmega128 datasheet, "Boot Loader
//! Support", SPMCSR). So a period of the joints' control never waits for the work that follows from a byte.

use avr_device::atmega128a::BOOT_LOAD;
use kernel::{Context, Interrupt, Masked, MaskedCell};

use crate::period;

/// The sources of work that can be handed over: a bit each, the lowest is served first.
#[doc(hidden)]
pub mod source {
    /// A round of measurement has begun, [`adc::round`](crate::adc::round).
    pub const ROUND: u8 = 1 << 0;
    /// The two-wire bus is held for an answer.
    pub const TWI: u8 = 1 << 1;
    /// A line has something for the task that receives.
    pub const USART0: u8 = 1 << 2;
    pub const USART1: u8 = 1 << 3;
    pub const SOFT_UART: u8 = 1 << 4;
    /// The last stop bit of the UART in software is on the wire.
    pub const SOFT_UART_SENT: u8 = 1 << 5;
    /// A conversion of an input that is not the joints' is complete.
    pub const CONVERSION: u8 = 1 << 6;
}

/// The sources that were raised and not served, and [`IS_SERVING`].
static RAISED: MaskedCell<u8> = MaskedCell::new(0);

/// Set while the software interrupt serves a source: other interrupts may occur, but not itself.
const IS_SERVING: u8 = 1 << 7;

/// SPMCSR: the interrupt is enabled.
const ENABLED: u8 = 1 << 7; // SPMIE

#[inline(always)]
fn enable(is_on: bool) {
    // SAFETY: only the bit SPMIE of SPMCSR is ever set. Without an instruction SPM the register does nothing
    // else.
    unsafe { BOOT_LOAD::steal().spmcsr().write(|w| w.bits(if is_on { ENABLED } else { 0 })) };
}

/// Makes the software interrupt serve `source`, once. 10 cycles.
#[inline(always)]
pub(crate) fn raise(masked: &Masked, source: u8) {
    let raised = RAISED.get(masked) | source;
    RAISED.set(masked, raised);
    if raised & IS_SERVING == 0 {
        enable(true);
    }
}

/// Cancels `source`, if the software interrupt has not served it yet.
pub(crate) fn withdraw(masked: &Masked, source: u8) {
    let others = RAISED.get(masked) & !source;
    RAISED.set(masked, others);
    if others == 0 {
        enable(false);
    }
}

/// Whether `source` was raised and is not served yet.
#[inline(always)]
pub(crate) fn waits(masked: &Masked, source: u8) -> bool {
    RAISED.get(masked) & source != 0
}

/// Whether the software interrupt has nothing to serve, and is disabled. Only then may a write to the EEPROM
/// begin: while one is under way, writing SPMCSR may have no effect ("EEPROM Write Prevents Writing to
/// SPMCSR").
#[inline(always)]
pub(crate) fn is_free(masked: &Masked) -> bool {
    RAISED.get(masked) == 0
}

/// Enables the software interrupt for what was raised while the EEPROM was written.
#[inline(always)]
pub(crate) fn renew(masked: &Masked) {
    if !is_free(masked) {
        enable(true);
    }
}

/// The software interrupt while it serves a source. Other interrupts may occur in a [window](Self::window),
/// but not itself.
#[doc(hidden)]
pub struct Serving<'a> {
    pub(crate) interrupt: &'a mut Interrupt,
    source: u8,
}

impl<'a> Serving<'a> {
    /// Begins with the source to be served now. For the other sources that were raised, the interrupt occurs
    /// again, after those before it in the order of the vectors.
    ///
    /// # Safety
    /// Only in the software interrupt.
    #[inline(always)]
    pub unsafe fn begin(interrupt: &'a mut Interrupt) -> Self {
        let source = interrupt.mask(|masked| {
            period::begin_if_due_by_call(masked);
            let raised = RAISED.get(masked);
            let others = raised & raised.wrapping_sub(1);
            RAISED.set(masked, others | IS_SERVING);
            enable(false);
            raised & !others
        });
        Serving { interrupt, source }
    }

    /// Whether this [source] is the one that is served.
    #[inline(always)]
    pub fn is(&self, source: u8) -> bool {
        self.source & source != 0
    }

    /// Lets other interrupts occur.
    #[inline(always)]
    pub(crate) fn window(&mut self) {
        // SAFETY: this is the software interrupt, which is disabled; no handler enables it while it serves.
        unsafe { self.interrupt.window() };
    }

    /// Ends the service of the source.
    #[inline(always)]
    pub fn end(mut self) {
        self.window();
        self.interrupt.mask(|masked| {
            let others = RAISED.get(masked) & !IS_SERVING;
            RAISED.set(masked, others);
            if others != 0 {
                enable(true);
            }
        });
    }
}

/// Defines a vector that does not enter the kernel. `$body` gets the proof that interrupts are masked. All
/// others wait for it: for those that must not be late, [`board/releases.toml`](../releases.toml) has the
/// deadlines, and `./x response` prints the time that is left.
///
/// It must not call a function that is not inlined, or the compiler saves all registers that a call may
/// change. With tickless idle, a vector that stores the time does call one, and takes 500 cycles if it ends a
/// sleep.
#[doc(hidden)]
#[macro_export]
macro_rules! fast_interrupt {
    ($(#[$attribute:meta])* fn $vector:ident($masked:ident) $body:block) => {
        $(#[$attribute])*
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $vector() -> ! {
            $crate::fast_handler! {
                #[unsafe(export_name = concat!(stringify!($vector), "_handler"))]
                fn handler($masked) $body
            }
            // SAFETY: the hardware comes here, and `handler` restores all registers and flags.
            unsafe {
                ::core::arch::asm!(
                    $crate::call_handler!(handler), // 8
                    handler = sym handler,
                    options(noreturn),
                )
            }
        }
    };
}

/// Defines the vector INT7, which calls `$rises` or `$changes`, two [fast handlers](fast_handler).
///
/// It is in assembly, as Rust would save what the longer of the two needs before it could read the line. So
/// rising edges, half of all edges, take 40 cycles less. No register and no flag changes.
#[doc(hidden)]
#[macro_export]
macro_rules! line_interrupt {
    ($rises:ident, $changes:ident) => {
        /// INT7.
        #[unsafe(no_mangle)]
        unsafe extern "C" fn __vector_8() -> ! {
            // SAFETY: the hardware comes here, and the handlers restore all registers and flags.
            unsafe {
                ::core::arch::asm!(
                    "sbis 0x01, 7",    // 2, or 1: PINE7 skips the next if the line is high
                    "rjmp 2f",         // 2
                    "push r24",        // 2
                    "lds r24, 0x8a",   // 2: TCCR3B
                    "sbrs r24, 6",     // 2, or 1: ICES3 skips the next if a rise is expected
                    "rjmp 1f",         // 2
                    "pop r24",         // 2
                    $crate::call_handler!(rises), // 8
                    "1:",
                    "pop r24",         // 2
                    "2:",
                    $crate::call_handler!(changes), // 8
                    rises = sym $rises,
                    changes = sym $changes,
                    options(noreturn),
                )
            }
        }
    };
}

/// Defines a handler for a vector that [calls](call_handler) it. It saves the registers that it uses.
#[doc(hidden)]
#[macro_export]
macro_rules! fast_handler {
    ($(#[$attribute:meta])* fn $name:ident($masked:ident) $body:block) => {
        $(#[$attribute])*
        unsafe extern "avr-interrupt" fn $name() {
            // SAFETY: a vector calls this with interrupts masked, and nothing enables them before the
            // return. The context is lent as `Masked` alone, with which no kernel call can be made.
            let mut interrupt = unsafe { $crate::kernel::Interrupt::assume() };
            $crate::kernel::Context::mask(&mut interrupt, |$masked| $body)
        }
    };
}

/// The end of a vector, in assembly: it calls a handler, an operand of this name, which returns by `reti`,
/// and returns itself by `ret`.
///
/// Behind `reti` the CPU executes one instruction before the next interrupt (ATmega128 datasheet, "Reset and
/// Interrupt Handling"). That is this `ret`. Otherwise it would be one of the interrupted program; and were
/// that the `cli` of a critical section, a pending interrupt would wait for the whole section.
///
/// The linker's `--relax` would make a jump of a `call` before a `ret`, but not of two words.
#[doc(hidden)]
#[macro_export]
macro_rules! call_handler {
    ($name:ident) => {
        // 4 cycles for `call`, in two words, and 4 for `ret`
        concat!(".word 0x940e\n.word gs({", stringify!($name), "})\nret")
    };
}
