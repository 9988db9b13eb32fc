//! The two USARTs. There is one interrupt per byte, both ways; it involves the kernel only at the end of a
//! frame.

mod registers;

use kernel::{Interrupt, Masked, Task};

pub use registers::{Usart, Usart0, Usart1};

use crate::deferred;
use crate::gpio::{Port as _, PortD, PortE};
use crate::interrupts::Serves;
use crate::serial::{Line, Port, Receiver, Transmitter};
use crate::superbot::{BAUD, CLOCK_HZ};
use registers::{DATA_OVERRUN, DOUBLE_SPEED, FINISHING, FRAME_ERROR, RECEIVING, SENDING, TRANSMIT_COMPLETE};

/// UBRRn at double speed: the nearest to 8 * BAUD clocks a bit, less one.
const DIVISOR: u16 = {
    let divisor = (CLOCK_HZ + 4 * BAUD) / (8 * BAUD) - 1;
    assert!(divisor < 1 << 12, "the baud rate is too low for UBRR");
    divisor as u16
};

/// What tasks and interrupts share.
#[doc(hidden)]
pub static PORT0: Port = Port::new();
#[doc(hidden)]
pub static PORT1: Port = Port::new();

/// UCSRnA: errors of the byte in UDRn, or after it.
const ERRORS: u8 = FRAME_ERROR | DATA_OVERRUN;

macro_rules! start {
    ($($Usart:ident: $PORT:ident, $RxPort:ident $rx:literal;)+) => {$(
        impl $Usart {
            /// Starts the USART at [`BAUD`], full duplex. RXDn is pulled up, so that a dock without a
            /// receiver is idle.
            pub fn start(self, _: impl Serves<$Usart>) -> (Transmitter, Receiver) {
                $RxPort::set_output(1 << $rx, true);
                $Usart::set_baud(DIVISOR);
                $Usart::set_status(DOUBLE_SPEED);
                $Usart::set_control(RECEIVING);
                (Transmitter::of::<$Usart>(), Receiver::of::<$Usart>())
            }
        }

        impl Line for $Usart {
            #[inline(always)]
            fn port() -> &'static Port {
                &$PORT
            }

            fn begin(_: &mut Task) -> bool {
                $Usart::set_control(SENDING);
                true
            }
        }
    )+};
}
start! {
    Usart0: PORT0, PortE 0;
    Usart1: PORT1, PortD 2;
}

/// The interrupt "USART, Rx Complete", which does not enter the kernel. `source` wakes the task.
#[doc(hidden)]
#[inline(always)]
pub fn receive_complete<U: Usart>(masked: &Masked, source: u8) {
    let status = U::status(); // of the byte in UDRn, so read before it
    let byte = U::data();
    if status & ERRORS != 0 {
        U::port().lose(masked);
        if status & FRAME_ERROR != 0 {
            return; // no byte: a line held low must not look like a stream of ends of frames
        }
    }
    if U::port().put(masked, byte) {
        deferred::raise(masked, source);
    }
}

/// The interrupt "USART, Data Register Empty", which does not enter the kernel.
#[doc(hidden)]
#[inline(always)]
pub fn data_register_empty<U: Usart>(masked: &Masked) {
    let Some((byte, is_last)) = U::port().next(masked) else {
        return U::set_control(RECEIVING);
    };
    U::set_data(byte);
    if is_last {
        // The flag may be set since the byte before. Once it is cleared here, only the last byte can set it,
        // which takes the time of a character from here.
        U::set_status(DOUBLE_SPEED | TRANSMIT_COMPLETE);
        U::set_control(FINISHING);
    }
}

/// The interrupt "USART, Tx Complete".
///
/// # Safety
/// Only in that interrupt: it lets others nest.
#[doc(hidden)]
#[inline(always)]
pub unsafe fn transmit_complete<U: Usart>(interrupt: &mut Interrupt) {
    U::set_control(RECEIVING);
    // SAFETY: this interrupt is disabled until a task sends again, and none runs before the end of this one.
    unsafe { interrupt.window() };
    U::port().finish(interrupt);
    // SAFETY: this interrupt is still disabled, for the same reason.
    unsafe { interrupt.window() };
}
