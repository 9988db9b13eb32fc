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
    };
}

/// Assembly with which a vector begins that saves what it uses: 7 cycles. Z is free from here on, and r0 holds SREG to the end. Of
/// this `kernel_enter_with_status` goes on, too.
#[doc(hidden)]
#[macro_export]
macro_rules! enter_vector {
    () => {
        concat!(
            "push r31\n",    // 2
            "push r30\n",    // 2
            "push r0\n",     // 2
            "in r0, 0x3f\n", // 1: SREG
        )
    };
}

/// Assembly with which it ends: 11 cycles.
#[doc(hidden)]
#[macro_export]
macro_rules! leave_vector {
    () => {
        concat!(
            "out 0x3f, r0\n", // 1
            "pop r0\n",       // 2
            "pop r30\n",      // 2
            "pop r31\n",      // 2
            "reti\n",         // 4
        )
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
        $crate::receive_interrupt!(__vector_18, $crate::usart::Usart0, $crate::usart::PORT0, 0x2b, 0x2c);
        $crate::transmit_interrupt!(__vector_19, $crate::usart::Usart0, $crate::usart::PORT0, 0x2c);
        $crate::vectors!(usart $crate::usart::Usart0, __vector_20 for $name);
    };
    (Usart1 for $name:ident) => {
        $crate::receive_interrupt!(__vector_30, $crate::usart::Usart1, $crate::usart::PORT1, 0x9b, 0x9c);
        $crate::transmit_interrupt!(__vector_31, $crate::usart::Usart1, $crate::usart::PORT1, 0x9c);
        $crate::vectors!(usart $crate::usart::Usart1, __vector_32 for $name);
    };
    (usart $usart:ty, $transmit_complete:ident for $name:ident) => {
        $crate::kernel::interrupt! {
            fn $transmit_complete(interrupt) { $crate::usart::transmit_complete::<$usart>(interrupt) }
        }
        // SAFETY: RX, UDRE and TX, above.
        unsafe impl $crate::interrupts::Serves<$usart> for $name {}
    };
    (SoftUart for $name:ident) => {
        $crate::soft_uart_interrupts!();
        $crate::kernel::interrupt! {
            fn __vector_26(interrupt) { $crate::soft_uart::wake(interrupt) }
        }
        // SAFETY: INT5, INT7, TIMER3_COMPA and TIMER3_COMPB, above.
        unsafe impl $crate::interrupts::Serves<$crate::soft_uart::SoftUart> for $name {}
    };
    (Adc for $name:ident) => {
        $crate::round_interrupt!(__vector_9);
        $crate::conversion_interrupt!(__vector_21);
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
        $crate::twi_interrupt!(__vector_33, $crate::twi::status_changed, $crate::twi::wake);
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
