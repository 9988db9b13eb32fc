//! Vectors: what the hardware comes to in an interrupt.

/// Declares interrupt handlers. Each runs on the kernel's stack with interrupts masked, and gets an
/// [`Interrupt`](crate::Interrupt) to make kernel calls with.
///
/// ```ignore
/// kernel::interrupt! {
///     /// USART0 has received a byte.
///     fn __vector_18(interrupt) { RECEIVED.post(interrupt); }
/// }
/// ```
/// The names are the linker's: `__vector_` and the vector's number (ATmega128 datasheet, "Interrupts", counted from 0).
#[macro_export]
macro_rules! interrupt {
    ($($(#[$attribute:meta])* fn $vector:ident($interrupt:ident) $body:block)*) => {$(
        $(#[$attribute])*
        #[unsafe(no_mangle)]
        #[unsafe(link_section = ".lowtext.kernel")]
        unsafe extern "C" fn $vector() -> ! {
            extern "C" fn handler() {
                // SAFETY: only the vector calls this, with interrupts masked.
                let $interrupt = &mut unsafe { $crate::Interrupt::assume() };
                $body
            }
            // SAFETY: the hardware comes here, and `kernel_enter_interrupt` restores all that the handler may change.
            unsafe { core::arch::asm!(
                "push r31",               // 2
                "push r30",               // 2
                "ldi r30, lo8(gs({handler}))", // 1: Z = the handler, in words
                "ldi r31, hi8(gs({handler}))", // 1
                "rjmp {enter}",           // 2: `.lowtext` holds the kernel's entry, too
                handler = sym handler,
                enter = sym $crate::arch::kernel_enter_interrupt,
                options(noreturn),
            ) }
        }
    )*};
}

/// Declares the vector that drives the kernel's tick.
///
/// It counts down to the first timer: 35 cycles a tick with the interrupt's own 11, however many timers are
/// armed. Only when one is due does it become an interrupt like any other.
#[macro_export]
macro_rules! tick_interrupt {
    ($vector:ident) => {
        #[unsafe(no_mangle)]
        #[unsafe(link_section = ".lowtext.kernel")]
        unsafe extern "C" fn $vector() -> ! {
            // SAFETY: the hardware comes here, and `kernel_enter_interrupt` restores all that the handler may change.
            unsafe { core::arch::asm!(
                "push r31",               // 2
                "push r30",               // 2
                "push r0",                // 2
                "in r0, 0x3f",            // 1: SREG
                "lds r30, {ticks}",       // 2
                "lds r31, {ticks}+1",     // 2
                "adiw r30, 1",            // 2
                "sts {ticks}, r30",       // 2
                "sts {ticks}+1, r31",     // 2
                "lds r30, {left}",        // 2: Z = ticks until the first timer is due
                "lds r31, {left}+1",      // 2
                "sbiw r30, 1",            // 2
                "sts {left}, r30",        // 2
                "sts {left}+1, r31",      // 2
                "breq 1f",                // 1, or 2 when a timer is due
                "out 0x3f, r0",           // 1
                "pop r0",                 // 2
                "pop r30",                // 2
                "pop r31",                // 2
                "reti",                   // 4
                "1:",
                "ldi r30, lo8(gs({expire}))", // 1: Z = the handler, in words
                "ldi r31, hi8(gs({expire}))", // 1
                "rjmp {enter}",           // 2
                ticks = sym $crate::TICKS,
                left = sym $crate::TICKS_LEFT,
                expire = sym $crate::arch::kernel_expire,
                enter = sym $crate::arch::kernel_enter_with_status,
                options(noreturn),
            ) }
        }
    };
}

/// Declares the clock of tasks' times, for the feature `cpu-time`: the address of a 16-bit counter that runs through all its
/// values, and two vectors that come half a turn apart. With one a turn, a whole turn might pass between two readings.
///
/// ```ignore
/// kernel::clock_interrupts!(0x88, __vector_26, __vector_29);
/// ```
#[cfg(feature = "cpu-time")]
#[macro_export]
macro_rules! clock_interrupts {
    ($counter:literal, $one:ident, $other:ident) => {
        core::arch::global_asm!(".global kernel_clock", concat!(".set kernel_clock, ", $counter),);
        $crate::interrupt! {
            fn $one(interrupt) { $crate::charge_in_turn(interrupt) }
            fn $other(interrupt) { $crate::charge_in_turn(interrupt) }
        }
    };
}

/// Declares the vector that drives the kernel's tick where idle is tickless, for the feature `tickless`: that of the compare
/// unit of a [`TickTimer`](crate::tickless::TickTimer). It takes the place of [`tick_interrupt!`](crate::tick_interrupt!).
#[cfg(feature = "tickless")]
#[macro_export]
macro_rules! tickless_interrupt {
    ($vector:ident, $timer:ty) => {
        #[unsafe(no_mangle)]
        extern "C" fn kernel_before_sleep() {
            $crate::tickless::before_sleep::<$timer>();
        }
        #[unsafe(no_mangle)]
        extern "C" fn kernel_after_sleep() {
            $crate::tickless::after_sleep::<$timer>();
        }
        #[unsafe(no_mangle)]
        extern "C" fn kernel_tick() -> bool {
            $crate::tickless::tick::<$timer>()
        }
        #[unsafe(no_mangle)]
        #[unsafe(link_section = ".lowtext.kernel")]
        unsafe extern "C" fn $vector() -> ! {
            // SAFETY: the hardware comes here, and `kernel_enter_interrupt` restores all that the handler may change.
            unsafe { core::arch::asm!(
                "push r31",               // 2
                "push r30",               // 2
                "ldi r30, lo8(gs(kernel_tickless))", // 1: Z = the handler, in words
                "ldi r31, hi8(gs(kernel_tickless))", // 1
                "rjmp {enter}",           // 2
                enter = sym $crate::arch::kernel_enter_interrupt,
                options(noreturn),
            ) }
        }
    };
}

/// Declares the vector of the trap, for [`TaskHandle::step`](crate::TaskHandle::step): an interrupt that stays pending until the
/// block disables it, and goes before all others that are enabled meanwhile.
///
/// ```ignore
/// kernel::trap_interrupt! { fn __vector_9(interrupt) { disable_the_trap(interrupt) } }
/// ```
#[macro_export]
macro_rules! trap_interrupt {
    (fn $vector:ident($interrupt:ident) $body:block) => {
        #[unsafe(no_mangle)]
        #[unsafe(link_section = ".lowtext.kernel")]
        unsafe extern "C" fn $vector() -> ! {
            extern "C" fn handler() {
                // SAFETY: only the vector calls this, with interrupts masked.
                let $interrupt = &mut unsafe { $crate::Interrupt::assume() };
                if $crate::stepped($interrupt) {
                    $body
                }
            }
            // SAFETY: the hardware comes here, and either nothing is changed, or `kernel_enter_interrupt` restores all.
            unsafe { core::arch::asm!(
                "push r31",               // 2
                "push r30",               // 2
                "push r0",                // 2
                "in r0, 0x3f",            // 1: SREG
                "lds r30, {stepped}",     // 2: the low byte of the task that is to make a step
                "lds r31, {kernel}+{running}", // 2: and of the one that runs
                "cp r30, r31",            // 1
                "brne 1f",                // 1, or 2
                "lds r30, {stepped}+1",   // 2: the high bytes
                "lds r31, {kernel}+{running}+1", // 2
                "cp r30, r31",            // 1
                "brne 1f",                // 1, or 2
                "out 0x3f, r0",           // 1
                "pop r0",                 // 2
                "ldi r30, lo8(gs({handler}))", // 1: Z = the handler, in words
                "ldi r31, hi8(gs({handler}))", // 1
                "rjmp {enter}",           // 2
                "1:",
                "out 0x3f, r0",           // 1
                "pop r0",                 // 2
                "pop r30",                // 2
                "pop r31",                // 2
                "reti",                   // 4: and one instruction of what was struck
                handler = sym handler,
                stepped = sym $crate::STEPPED,
                kernel = sym $crate::KERNEL,
                running = const $crate::arch::RUNNING,
                enter = sym $crate::arch::kernel_enter_interrupt,
                options(noreturn),
            ) }
        }
    };
}
