//! Which program serves which interrupts.
//!
//! A vector, once linked, brings its handler and all that it uses. So the program says which devices it
//! starts, in [`interrupts!`](crate::interrupts!), and gets just their vectors; and a device asks for the
//! proof before it starts.

/// Proof that the vectors of the device `D` are linked.
///
/// # Safety
/// They must be; [`interrupts!`](crate::interrupts!) sees to it.
#[diagnostic::on_unimplemented(
    message = "no interrupt vectors for `{D}`",
    note = "name it in `board::interrupts!({Self}: ...)`"
)]
pub unsafe trait Serves<D> {}

/// Defines the interrupt vectors of the devices named, and a type that proves it.
///
/// ```ignore
/// board::interrupts!(Interrupts: Tick, Usart0, Usart1, Twi, Adc);
/// ```
/// Once in a program: a second definition of a vector does not link. `I2c` serves `Twi` too, for they share
/// a vector: a program that starts both names `I2c` alone.
#[macro_export]
macro_rules! interrupts {
    ($name:ident: $($device:ident),+ $(,)?) => {
        /// Proof that the vectors of the devices in use are linked.
        #[derive(Clone, Copy)]
        struct $name;
        $($crate::vectors!($device for $name);)+
        $crate::deferred_interrupt!(for $($device)+);
    };
}

/// The vectors of one device. Numbers are the ATmega128's (datasheet, "Interrupt Vectors", counted from 0); those by which
/// MCUs differ stand in [`mcu`](crate::mcu).
#[doc(hidden)]
#[macro_export]
macro_rules! vectors {
    (Tick for $name:ident) => {
        $crate::tick_interrupt!();
        // SAFETY: above.
        unsafe impl $crate::interrupts::Serves<$crate::tick::Tick> for $name {}
    };
    (Trap for $name:ident) => {
        $crate::trap_interrupt!();
        // SAFETY: above.
        unsafe impl $crate::interrupts::Serves<$crate::trap::Trap> for $name {}
    };
    (CpuClock for $name:ident) => {
        $crate::kernel::clock_interrupts!(0x88, __vector_26, __vector_29);
        // SAFETY: TIMER3_COMPA and TIMER3_OVF, above; TCNT3 lies at 0x88.
        unsafe impl $crate::interrupts::Serves<$crate::cpu_clock::CpuClock> for $name {}
    };
    (Usart0 for $name:ident) => {
        $crate::vectors!(usart $crate::usart::Usart0, USART0, __vector_18, __vector_19, __vector_20 for $name);
    };
    (Usart1 for $name:ident) => {
        $crate::vectors!(usart $crate::usart::Usart1, USART1, __vector_30, __vector_31, __vector_32 for $name);
    };
    (usart $usart:ty, $source:ident, $receive:ident, $transmit:ident, $transmit_complete:ident for $name:ident) => {
        $crate::fast_interrupt! {
            fn $receive(masked) {
                $crate::usart::receive_complete::<$usart>(masked, $crate::deferred::source::$source)
            }
        }
        $crate::fast_interrupt! {
            fn $transmit(masked) { $crate::usart::data_register_empty::<$usart>(masked) }
        }
        $crate::kernel::interrupt! {
            fn $transmit_complete(interrupt) { $crate::usart::transmit_complete::<$usart>(interrupt) }
        }
        // SAFETY: RX, UDRE and TX, above.
        unsafe impl $crate::interrupts::Serves<$usart> for $name {}
    };
    (SoftUart for $name:ident) => {
        $crate::fast_interrupt! {
            /// INT5.
            fn __vector_6(masked) { $crate::soft_uart::pulse_begins(masked) }
        }
        $crate::fast_interrupt! {
            /// INT7.
            fn __vector_8(masked) { $crate::soft_uart::line_changes(masked) }
        }
        $crate::fast_interrupt! {
            /// TIMER3_COMPB.
            fn __vector_27(masked) { $crate::soft_uart::character_ends(masked) }
        }
        // SAFETY: INT5, INT7 and TIMER3_COMPB, above.
        unsafe impl $crate::interrupts::Serves<$crate::soft_uart::SoftUart> for $name {}
    };
    (Adc for $name:ident) => {
        $crate::fast_interrupt! {
            fn __vector_9(masked) { $crate::adc::begin_round(masked) }
        }
        $crate::fast_interrupt! {
            fn __vector_21(masked) { $crate::adc::conversion_complete(masked) }
        }
        // SAFETY: TIMER2_COMP and ADC, above.
        unsafe impl $crate::interrupts::Serves<$crate::adc::Adc> for $name {}
    };
    (Eeprom for $name:ident) => {
        $crate::kernel::interrupt! {
            fn __vector_22(interrupt) { $crate::eeprom::ready(interrupt) }
        }
        // SAFETY: EE READY, above.
        unsafe impl $crate::interrupts::Serves<$crate::eeprom::Eeprom> for $name {}
    };
    (External for $name:ident) => {
        $crate::external_interrupt!(interrupt => $crate::external::edge(interrupt));
        // SAFETY: above.
        unsafe impl $crate::interrupts::Serves<$crate::external::External> for $name {}
    };
    (Twi for $name:ident) => {
        $crate::fast_interrupt! {
            fn __vector_33(masked) { $crate::twi::status_changed(masked) }
        }
        // SAFETY: TWI, above.
        unsafe impl $crate::interrupts::Serves<$crate::twi::Twi> for $name {}
    };
    (I2c for $name:ident) => {
        $crate::kernel::interrupt! {
            fn __vector_33(interrupt) { $crate::twi::status_changed_with_i2c(interrupt) }
        }
        // SAFETY: TWI, above. It serves the packets as well.
        unsafe impl $crate::interrupts::Serves<$crate::twi::Twi> for $name {}
        // SAFETY: likewise.
        unsafe impl $crate::interrupts::Serves<$crate::twi::I2c> for $name {}
    };
}
