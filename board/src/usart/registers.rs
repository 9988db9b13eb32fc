//! The registers of the two USARTs, which differ in their addresses only (ATmega128 datasheet, "USART").

use avr_device::atmega128a::{USART0, USART1};

use crate::serial::Line;

/// UCSRnA: a framing error in the byte in UDRn, which is the next to be read.
pub const FRAME_ERROR: u8 = 1 << 4;
/// UCSRnA: a byte was lost after the one in UDRn, because the two before had not been read.
pub const DATA_OVERRUN: u8 = 1 << 3;
/// UCSRnA: the last stop bit is on the wire and UDRn is empty. Writing one clears it.
pub const TRANSMIT_COMPLETE: u8 = 1 << 6;
/// UCSRnA: eight clocks a bit instead of sixteen.
pub const DOUBLE_SPEED: u8 = 1 << 1;

/// UCSRnB: the receiver and the transmitter are on, and nothing is sent.
pub const RECEIVING: u8 = 1 << 7 | 1 << 4 | 1 << 3; // RXCIE, RXEN, TXEN
/// UCSRnB: UDRn is filled whenever it is empty. The receiver stays on, and may receive a reflection: the link
/// recognises its own frames.
pub const SENDING: u8 = RECEIVING | 1 << 5; // UDRIE
/// UCSRnB: the last byte is on its way.
pub const FINISHING: u8 = RECEIVING | 1 << 6; // TXCIE

/// A USART, named by its type.
pub trait Usart: Line {
    /// UBRRn. After reset UCSRnC holds 8 data bits, no parity, 1 stop bit already.
    #[doc(hidden)]
    fn set_baud(divisor: u16);

    /// UCSRnA.
    #[doc(hidden)]
    fn status() -> u8;

    /// UCSRnA.
    #[doc(hidden)]
    fn set_status(bits: u8);

    /// UCSRnB.
    #[doc(hidden)]
    fn set_control(bits: u8);

    /// UDRn, the receive buffer.
    #[doc(hidden)]
    fn data() -> u8;

    /// UDRn, the transmit buffer.
    #[doc(hidden)]
    fn set_data(byte: u8);
}

macro_rules! usart {
    ($(#[$attribute:meta])* $Usart:ident: $block:ident,
     $data:ident, $status:ident, $control:ident, $baud_high:ident, $baud_low:ident) => {
        $(#[$attribute])*
        pub struct $Usart(());

        impl $Usart {
            pub(crate) const fn new() -> Self {
                $Usart(())
            }

            fn registers() -> $block {
                // SAFETY: one `Usart` exists and becomes one transmitter and one receiver. They and the
                // interrupts write these registers whole, so no write depends on another's.
                unsafe { $block::steal() }
            }
        }

        impl Usart for $Usart {
            fn set_baud(divisor: u16) {
                let [low, high] = divisor.to_le_bytes();
                // SAFETY: any divisor is a baud rate. The low byte goes last: writing it takes over both.
                Self::registers().$baud_high().write(|w| unsafe { w.bits(high) });
                // SAFETY: any divisor is a baud rate.
                Self::registers().$baud_low().write(|w| unsafe { w.bits(low) });
            }

            #[inline(always)]
            fn status() -> u8 {
                Self::registers().$status().read().bits()
            }

            #[inline(always)]
            fn set_status(bits: u8) {
                // SAFETY: the USART touches no memory, whatever its registers hold.
                Self::registers().$status().write(|w| unsafe { w.bits(bits) });
            }

            #[inline(always)]
            fn set_control(bits: u8) {
                // SAFETY: the USART touches no memory, whatever its registers hold.
                Self::registers().$control().write(|w| unsafe { w.bits(bits) });
            }

            #[inline(always)]
            fn data() -> u8 {
                Self::registers().$data().read().bits()
            }

            #[inline(always)]
            fn set_data(byte: u8) {
                // SAFETY: the USART touches no memory, whatever its registers hold.
                Self::registers().$data().write(|w| unsafe { w.bits(byte) });
            }
        }
    };
}

usart!(
    /// USART0: RXD0 = PE0, TXD0 = PE1.
    Usart0: USART0, udr0, ucsr0a, ucsr0b, ubrr0h, ubrr0l
);
usart!(
    /// USART1: RXD1 = PD2, TXD1 = PD3.
    Usart1: USART1, udr1, ucsr1a, ucsr1b, ubrr1h, ubrr1l
);
