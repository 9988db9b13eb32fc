//! Vectors that enter no kernel, and the interrupt by which they hand over what needs it.
//!
//! A handler of [`kernel::interrupt!`] may call the kernel, and pays for that with some 120 cycles: all
//! registers that a call may change are saved, and the stack is another. A byte in the middle of a frame
//! needs no kernel. The vectors that come for each byte or edge are therefore Rust functions with the ABI
//! `avr-interrupt`: the compiler saves the registers that they use, and no more. Where a task is to be woken
//! they raise a software interrupt, which posts.
//!
//! That interrupt is "Store Program Memory Ready". It lasts as long as it is enabled, since no program here
//! writes its own flash, and all others come first (ATmega128 datasheet, "Boot Loader Support", SPMCSR). So a
//! period of the joints' control never waits for a byte and for what follows from it.

use avr_device::atmega128a::BOOT_LOAD;
use kernel::{Context, Interrupt, Masked, MaskedCell};

use crate::joints;

/// What can be handed over: a bit each, the lowest is served first.
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
    /// A conversion is complete that is none of the joints'.
    pub const CONVERSION: u8 = 1 << 6;
}

/// What was raised and not served, and [`IS_SERVING`].
static RAISED: MaskedCell<u8> = MaskedCell::new(0);

/// While the software interrupt serves a source it lets others in, but not itself.
const IS_SERVING: u8 = 1 << 7;

/// SPMCSR: the interrupt is enabled.
const ENABLED: u8 = 1 << 7; // SPMIE

#[inline(always)]
fn enable(is_on: bool) {
    // SAFETY: of the bits of SPMCSR only SPMIE is ever set, and without an instruction SPM the register does
    // nothing else.
    unsafe { BOOT_LOAD::steal().spmcsr().write(|w| w.bits(if is_on { ENABLED } else { 0 })) };
}

/// Has the software interrupt serve `source`, once. 10 cycles.
#[inline(always)]
pub(crate) fn raise(masked: &Masked, source: u8) {
    let raised = RAISED.get(masked) | source;
    RAISED.set(masked, raised);
    if raised & IS_SERVING == 0 {
        enable(true);
    }
}

/// Has the software interrupt not serve `source`, if it has not yet.
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

/// Whether the software interrupt has nothing to serve, and is off. A write to the EEPROM begins only then:
/// as long as that lasts the chip may keep SPMCSR as it is ("EEPROM Write Prevents Writing to SPMCSR").
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

/// The software interrupt as it serves a source. Others may come in a [window](Self::window), but not itself.
#[doc(hidden)]
pub struct Serving<'a> {
    pub(crate) interrupt: &'a mut Interrupt,
    source: u8,
}

impl<'a> Serving<'a> {
    /// Begins with what is to be served now. What else was raised has the interrupt come again, after those
    /// that are before it in the order of the vectors.
    ///
    /// # Safety
    /// Only in the software interrupt.
    #[inline(always)]
    pub unsafe fn begin(interrupt: &'a mut Interrupt) -> Self {
        let source = interrupt.mask(|masked| {
            joints::begin_if_due_by_call(masked);
            let raised = RAISED.get(masked);
            let others = raised & raised.wrapping_sub(1);
            RAISED.set(masked, others | IS_SERVING);
            enable(false);
            raised & !others
        });
        Serving { interrupt, source }
    }

    /// Whether it is this [source] that is served.
    #[inline(always)]
    pub fn is(&self, source: u8) -> bool {
        self.source & source != 0
    }

    /// Lets others in.
    #[inline(always)]
    pub(crate) fn window(&mut self) {
        // SAFETY: this is the software interrupt, which is not enabled, and none enables it while it serves.
        unsafe { self.interrupt.window() };
    }

    /// It is served.
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

/// Defines a vector that enters no kernel. `$body` gets the proof that interrupts are masked. All others wait
/// for it: of those that must not be late [`board/releases.toml`](../releases.toml) has the deadlines, and
/// `./x response` prints what is left.
///
/// It must call no function that is not inlined: then the compiler would save all registers that a call may
/// change. Where idle is tickless, one that stores the time does, and takes 500 cycles where it ends a sleep.
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

/// Defines the vector INT7, which goes on to `$rises` or `$changes`, two [fast handlers](fast_handler).
///
/// Assembly, as Rust can't look at the line before it saves what the longer of the two needs: so rising
/// edges, which are half of them all, take 40 cycles less. No register and no flag changes.
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
                    "sbis 0x01, 7",    // 2, or 1: PINE7 skips the next where the line is high
                    "rjmp 2f",         // 2
                    "push r24",        // 2
                    "lds r24, 0x8a",   // 2: TCCR3B
                    "sbrs r24, 6",     // 2, or 1: ICES3 skips the next where it is to rise
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
            // SAFETY: a vector calls this, with interrupts masked, and nothing enables them before the return.
            // The context is lent as `Masked` alone, with which no kernel call can be made.
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
