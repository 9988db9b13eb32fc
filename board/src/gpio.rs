//! Digital pins, behind the traits of embedded-hal. A pin takes no memory.

use core::convert::Infallible;
use core::marker::PhantomData;

use avr_device::interrupt;
use embedded_hal::digital::{ErrorType, InputPin, OutputPin, StatefulOutputPin};

/// A port, named by its type.
pub trait Port {
    /// PINx.
    #[doc(hidden)]
    fn input() -> u8;

    /// PORTx: the level of an output, the pull-up of an input.
    #[doc(hidden)]
    fn output() -> u8;

    /// Sets or clears the bits `mask` of PORTx.
    #[doc(hidden)]
    fn set_output(mask: u8, value: bool);

    /// Sets or clears the bits `mask` of DDRx: whether the pins are outputs.
    #[doc(hidden)]
    fn set_direction(mask: u8, value: bool);
}

/// Pin `BIT` of port `P`, as reset leaves it: an input without pull-up.
pub struct Pin<P, const BIT: u8> {
    port: PhantomData<P>,
}

/// A pin that is read.
pub struct Input<P, const BIT: u8> {
    port: PhantomData<P>,
}

/// A pin that is driven.
pub struct Output<P, const BIT: u8> {
    port: PhantomData<P>,
}

impl<P: Port, const BIT: u8> Pin<P, BIT> {
    const MASK: u8 = 1 << BIT;

    pub(crate) const fn new() -> Self {
        Pin { port: PhantomData }
    }

    /// An input that something outside drives.
    pub fn into_input(self) -> Input<P, BIT> {
        Input { port: PhantomData }
    }

    /// An input that is high unless something outside drives it low.
    pub fn into_pull_up_input(self) -> Input<P, BIT> {
        P::set_output(Self::MASK, true);
        Input { port: PhantomData }
    }

    /// An output, low at first.
    pub fn into_output(self) -> Output<P, BIT> {
        P::set_direction(Self::MASK, true);
        Output { port: PhantomData }
    }
}

impl<P, const BIT: u8> ErrorType for Input<P, BIT> {
    type Error = Infallible;
}

impl<P: Port, const BIT: u8> InputPin for Input<P, BIT> {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(P::input() & Pin::<P, BIT>::MASK != 0)
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(P::input() & Pin::<P, BIT>::MASK == 0)
    }
}

impl<P, const BIT: u8> ErrorType for Output<P, BIT> {
    type Error = Infallible;
}

impl<P: Port, const BIT: u8> OutputPin for Output<P, BIT> {
    #[inline(always)]
    fn set_low(&mut self) -> Result<(), Infallible> {
        P::set_output(Pin::<P, BIT>::MASK, false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        P::set_output(Pin::<P, BIT>::MASK, true);
        Ok(())
    }
}

impl<P: Port, const BIT: u8> StatefulOutputPin for Output<P, BIT> {
    fn is_set_high(&mut self) -> Result<bool, Infallible> {
        Ok(P::output() & Pin::<P, BIT>::MASK != 0)
    }

    fn is_set_low(&mut self) -> Result<bool, Infallible> {
        Ok(P::output() & Pin::<P, BIT>::MASK == 0)
    }
}

macro_rules! ports {
    ($($Port:ident: $block:ident, $input:ident, $output:ident, $direction:ident;)+) => {$(
        pub enum $Port {}

        impl $Port {
            fn registers() -> avr_device::atmega128a::$block {
                // SAFETY: pins share these registers, so they change them with interrupts masked only.
                unsafe { avr_device::atmega128a::$block::steal() }
            }
        }

        impl Port for $Port {
            #[inline(always)]
            fn input() -> u8 {
                Self::registers().$input().read().bits()
            }

            #[inline(always)]
            fn output() -> u8 {
                Self::registers().$output().read().bits()
            }

            #[inline(always)]
            fn set_output(mask: u8, value: bool) {
                // SAFETY: a port touches no memory, whatever its registers hold.
                interrupt::free(|_| Self::registers().$output().modify(|r, w| unsafe {
                    w.bits(if value { r.bits() | mask } else { r.bits() & !mask })
                }));
            }

            #[inline(always)]
            fn set_direction(mask: u8, value: bool) {
                // SAFETY: a port touches no memory, whatever its registers hold.
                interrupt::free(|_| Self::registers().$direction().modify(|r, w| unsafe {
                    w.bits(if value { r.bits() | mask } else { r.bits() & !mask })
                }));
            }
        }
    )+};
}

ports! {
    PortA: PORTA, pina, porta, ddra;
    PortB: PORTB, pinb, portb, ddrb;
    PortC: PORTC, pinc, portc, ddrc;
    PortD: PORTD, pind, portd, ddrd;
    PortE: PORTE, pine, porte, ddre;
    PortF: PORTF, pinf, portf, ddrf;
    PortG: PORTG, ping, portg, ddrg;
}
