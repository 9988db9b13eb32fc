//! The ATmega328P.

#[cfg(not(feature = "qemu"))]
pub use avr_device::atmega328p::TC0;
#[cfg(feature = "qemu")]
pub use avr_device::atmega328p::TC1;
pub use avr_device::atmega328p::{AC, CPU, EXINT, TC2};

/// The tick's vector: TIMER0_COMPA.
#[cfg(not(feature = "qemu"))]
#[macro_export]
macro_rules! tick_interrupt {
    () => {
        $crate::kernel::tick_interrupt!(__vector_14);
    };
}

/// Defines what the external interrupt does, INT0 at pin PD2.
#[cfg(not(feature = "qemu"))]
#[macro_export]
macro_rules! external_interrupt {
    ($interrupt:ident => $body:expr) => {
        $crate::kernel::interrupt! {
            fn __vector_1($interrupt) { $body }
        }
    };
}

/// The vector of single steps: TIMER2_COMPA.
#[macro_export]
macro_rules! trap_interrupt {
    () => {
        $crate::kernel::trap_interrupt! {
            fn __vector_7(interrupt) { $crate::trap::disarm(interrupt) }
        }
    };
}
