//! The ATmega2560.

#[cfg(not(feature = "qemu"))]
pub use avr_device::atmega2560::TC0;
#[cfg(feature = "qemu")]
pub use avr_device::atmega2560::TC1;
pub use avr_device::atmega2560::{AC, CPU, EXINT, TC2};

/// The tick's vector: TIMER0_COMPA.
#[cfg(not(feature = "qemu"))]
#[macro_export]
macro_rules! tick_interrupt {
    () => {
        $crate::kernel::tick_interrupt!(__vector_21);
    };
}

/// Defines what the external interrupt does, INT0 at pin PD0.
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
            fn __vector_13(interrupt) { $crate::trap::disarm(interrupt) }
        }
    };
}
