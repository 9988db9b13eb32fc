//! The interrupt vectors that a program links.
//!
//! A vector, once linked, pulls in its handler and all that it uses. So a program names the devices that it
//! starts in [`interrupts!`](crate::interrupts!), and gets only their vectors. A device asks for the proof
//! before it starts.

/// Proof that the vectors of the device `D` are linked.
///
/// # Safety
/// They must be; [`interrupts!`](crate::interrupts!) makes sure of it.
#[diagnostic::on_unimplemented(
    message = "no interrupt vectors for `{D}`",
    note = "name it in `board::interrupts!({Self}: ...)`"
)]
pub unsafe trait Serves<D> {}

/// Defines the interrupt vectors of the named devices, and a type that proves it.
///
/// ```ignore
/// board::interrupts!(Interrupts: Tick, Usart0, Usart1, Twi, Adc);
/// ```
/// Use it once in a program: a second definition of a vector does not link. `I2c` serves `Twi` too, since
/// they share a vector: a program that starts both names `I2c` alone.
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

/// Defines the software interrupt, in a program with devices that raise it.
#[doc(hidden)]
#[macro_export]
macro_rules! deferred_interrupt {
    (for $($device:ident)+) => { $crate::deferred_interrupt!(if $($device)+; for $($device)+); };
    (if; for $($device:ident)+) => {};
    (if Usart0 $($rest:ident)*; for $($device:ident)+) => { $crate::deferred_interrupt!(serves $($device)+); };
    (if Usart1 $($rest:ident)*; for $($device:ident)+) => { $crate::deferred_interrupt!(serves $($device)+); };
    (if SoftUart $($rest:ident)*; for $($device:ident)+) => { $crate::deferred_interrupt!(serves $($device)+); };
    (if Twi $($rest:ident)*; for $($device:ident)+) => { $crate::deferred_interrupt!(serves $($device)+); };
    (if Adc $($rest:ident)*; for $($device:ident)+) => { $crate::deferred_interrupt!(serves $($device)+); };
    (if $other:ident $($rest:ident)*; for $($device:ident)+) => {
        $crate::deferred_interrupt!(if $($rest)*; for $($device)+);
    };
    (serves $($device:ident)+) => {
        $crate::kernel::interrupt! {
            /// "Store Program Memory Ready".
            fn __vector_34(interrupt) {
                // SAFETY: this is the software interrupt.
                let mut serving = unsafe { $crate::deferred::Serving::begin(interrupt) };
                'served: {
                    $($crate::serve!($device, serving, 'served);)+
                }
                serving.end();
                $crate::period::begin_before_leaving(interrupt);
            }
        }
    };
}

/// Serves a source of the device, if that is the one to be served, and ends the service then.
#[doc(hidden)]
#[macro_export]
macro_rules! serve {
    (Usart0, $serving:ident, $served:lifetime) => {
        if $serving.is($crate::deferred::source::USART0) {
            break $served $crate::usart::PORT0.wake(&mut $serving);
        }
    };
    (Usart1, $serving:ident, $served:lifetime) => {
        if $serving.is($crate::deferred::source::USART1) {
            break $served $crate::usart::PORT1.wake(&mut $serving);
        }
    };
    (SoftUart, $serving:ident, $served:lifetime) => {
        if $serving.is($crate::deferred::source::SOFT_UART) {
            break $served $crate::soft_uart::PORT.wake(&mut $serving);
        }
        if $serving.is($crate::deferred::source::SOFT_UART_SENT) {
            break $served $crate::soft_uart::sent(&mut $serving);
        }
    };
    (Twi, $serving:ident, $served:lifetime) => {
        if $serving.is($crate::deferred::source::TWI) {
            break $served $crate::twi::serve(&mut $serving);
        }
    };
    (Adc, $serving:ident, $served:lifetime) => {
        if $serving.is($crate::deferred::source::ROUND) {
            break $served $crate::adc::round(&mut $serving);
        }
        if $serving.is($crate::deferred::source::CONVERSION) {
            break $served $crate::adc::other_conversion_complete(&mut $serving);
        }
    };
    ($other:ident, $serving:ident, $served:lifetime) => {};
}

/// The vectors of one device. Numbers are the ATmega128's (datasheet, "Interrupt Vectors", counted from 0);
/// those that differ between MCUs are in [`mcu`](crate::mcu).
#[doc(hidden)]
#[macro_export]
macro_rules! vectors {
    (Tick for $name:ident) => {
        $crate::tick_interrupt!();
        // SAFETY: the line before defines the tick's vector.
        unsafe impl $crate::interrupts::Serves<$crate::tick::Tick> for $name {}
    };
    (Trap for $name:ident) => {
        $crate::trap_interrupt!();
        // SAFETY: the line before defines the vector of single steps.
        unsafe impl $crate::interrupts::Serves<$crate::trap::Trap> for $name {}
    };
    (CpuClock for $name:ident) => {
        $crate::kernel::clock_interrupts!(0x88, __vector_26, __vector_29);
        // SAFETY: the line before defines TIMER3_COMPA and TIMER3_OVF; TCNT3 lies at 0x88.
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
            fn $transmit_complete(interrupt) {
                // SAFETY: this is its interrupt.
                unsafe { $crate::usart::transmit_complete::<$usart>(interrupt) };
                $crate::period::begin_before_leaving(interrupt);
            }
        }
        // SAFETY: the lines before define its three vectors: RX, UDRE and TX.
        unsafe impl $crate::interrupts::Serves<$usart> for $name {}
    };
    (SoftUart for $name:ident) => {
        $crate::fast_interrupt! {
            /// INT5.
            fn __vector_6(masked) { $crate::soft_uart::pulse_begins(masked) }
        }
        $crate::fast_handler! {
            #[unsafe(no_mangle)]
            fn soft_uart_line_rises(masked) { $crate::soft_uart::line_rises(masked) }
        }
        $crate::fast_handler! {
            #[unsafe(no_mangle)]
            fn soft_uart_line_changes(masked) { $crate::soft_uart::line_changes(masked) }
        }
        $crate::line_interrupt!(soft_uart_line_rises, soft_uart_line_changes);
        $crate::fast_interrupt! {
            /// TIMER3_COMPB.
            fn __vector_27(masked) { $crate::soft_uart::character_ends(masked) }
        }
        // SAFETY: the lines before define its three vectors: INT5, INT7 and TIMER3_COMPB.
        unsafe impl $crate::interrupts::Serves<$crate::soft_uart::SoftUart> for $name {}
    };
    (Adc for $name:ident) => {
        $crate::fast_interrupt! {
            fn __vector_9(masked) { $crate::adc::begin_round(masked) }
        }
        $crate::fast_interrupt! {
            fn __vector_21(masked) { $crate::adc::conversion_complete(masked) }
        }
        // SAFETY: the lines before define its two vectors: TIMER2_COMP and ADC.
        unsafe impl $crate::interrupts::Serves<$crate::adc::Adc> for $name {}
    };
    (Eeprom for $name:ident) => {
        $crate::kernel::interrupt! {
            fn __vector_22(interrupt) { $crate::eeprom::ready(interrupt) }
        }
        // SAFETY: the lines before define its vector, EE READY.
        unsafe impl $crate::interrupts::Serves<$crate::eeprom::Eeprom> for $name {}
    };
    (External for $name:ident) => {
        $crate::external_interrupt!(interrupt => $crate::external::edge(interrupt));
        // SAFETY: the line before defines the vector of the external interrupt.
        unsafe impl $crate::interrupts::Serves<$crate::external::External> for $name {}
    };
    (Twi for $name:ident) => {
        $crate::fast_interrupt! {
            fn __vector_33(masked) { $crate::twi::status_changed(masked) }
        }
        // SAFETY: the lines before define its vector, TWI.
        unsafe impl $crate::interrupts::Serves<$crate::twi::Twi> for $name {}
    };
    (I2c for $name:ident) => {
        $crate::kernel::interrupt! {
            fn __vector_33(interrupt) { $crate::twi::status_changed_with_i2c(interrupt) }
        }
        // SAFETY: the lines before define the vector TWI, whose handler answers for packets as well.
        unsafe impl $crate::interrupts::Serves<$crate::twi::Twi> for $name {}
        // SAFETY: the vector TWI, linked above, serves transactions with other devices, too.
        unsafe impl $crate::interrupts::Serves<$crate::twi::I2c> for $name {}
    };
}
