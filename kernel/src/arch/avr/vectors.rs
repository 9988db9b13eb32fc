//! Interrupt vectors: the code that the hardware enters.

/// Declares interrupt handlers. Each runs on the kernel's stack with interrupts masked, and gets an
/// [`Interrupt`](crate::Interrupt) to make kernel calls with.
///
/// ```ignore
/// kernel::interrupt! {
///     /// USART0 has received a byte.
///     fn __vector_18(interrupt) { RECEIVED.post(interrupt); }
/// }
/// ```
/// The names are the linker's: `__vector_` and the vector's number (ATmega128 datasheet, "Interrupts",
/// counted from 0). Another name does not compile, and a number that the MCU does not have does not link. A
/// constant after `as`, such as the interrupts of `avr-device`, says which vector is meant; then a wrong
/// number does not compile either:
///
/// ```ignore
/// kernel::interrupt! {
///     fn __vector_18(interrupt) as avr_device::atmega128a::Interrupt::USART0_RX { ... }
/// }
/// ```
#[macro_export]
macro_rules! interrupt {
    ($($(#[$attribute:meta])* fn $vector:ident($interrupt:ident) $(as $meant:path)? $body:block)*) => {$(
        $crate::assert_vector!($vector $(as $meant)?);
        $(#[$attribute])*
        #[unsafe(no_mangle)]
        #[unsafe(link_section = ".lowtext.kernel")]
        unsafe extern "C" fn $vector() -> ! {
            // Named like the vector, so that no name of this macro hides a function that the body calls.
            #[inline(always)]
            fn $vector($interrupt: &mut $crate::Interrupt) $body
            {
                extern "C" fn handler() {
                    // SAFETY: only the vector calls this, with interrupts masked.
                    $vector(&mut unsafe { $crate::Interrupt::assume() })
                }
                // SAFETY: only the hardware enters here, and `kernel_enter_interrupt` restores all that the
                // handler may change.
                unsafe { ::core::arch::asm!(
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
        }
    )*};
}

/// Declares the vector that drives the kernel's tick.
///
/// It increments the present tick and compares it with the first deadline: 40 cycles a tick with the
/// interrupt's own 6, or 46 in one tick of 256, however many timers are armed. Only when a timer is due does
/// it enter the kernel like any other interrupt. It does what `timer::count_tick` does on the host.
#[macro_export]
macro_rules! tick_interrupt {
    ($vector:ident $(as $meant:path)?) => {
        $crate::assert_vector!($vector $(as $meant)?);
        #[unsafe(no_mangle)]
        #[unsafe(link_section = ".lowtext.kernel")]
        unsafe extern "C" fn $vector() -> ! {
            // SAFETY: only the hardware enters here, and `kernel_enter_with_status` restores all that the
            // handler may change.
            unsafe { ::core::arch::asm!(
                ".global kernel_needs_tick_interrupt",
                ".set kernel_needs_tick_interrupt, 0", // here it is
                "push r31",               // 2
                "push r30",               // 2
                "push r0",                // 2
                "in r0, 0x3f",            // 1: SREG
                "lds r30, {ticks}",       // 2: Z = the present tick
                "lds r31, {ticks}+1",     // 2
                "adiw r30, 1",            // 2
                "sts {ticks}, r30",       // 2
                "sts {ticks}+1, r31",     // 2
                "lds r31, {next}",        // 2: is its low byte that of the first deadline?
                "cpse r31, r30",          // 1, or 2
                "rjmp 1f",                // 2: no
                "lds r30, {ticks}+1",     // 2: and is the high byte?
                "lds r31, {next}+1",      // 2
                "cpse r31, r30",          // 1, or 2
                "rjmp 1f",                // 2: no
                "ldi r30, lo8(gs({expire}))", // 1: Z = the handler, in words
                "ldi r31, hi8(gs({expire}))", // 1
                "rjmp {enter}",           // 2
                "1:",
                "out 0x3f, r0",           // 1
                "pop r0",                 // 2
                "pop r30",                // 2
                "pop r31",                // 2
                "sei",                    // 1: takes effect after the next instruction,
                ".set tick_goes_on, .",
                "ret",                    // 4: so what waits comes before what was preempted
                ticks = sym $crate::TICKS,
                next = sym $crate::NEXT_DEADLINE,
                expire = sym $crate::expire,
                enter = sym $crate::arch::kernel_enter_with_status,
                options(noreturn),
            ) }
        }
    };
}

/// Declares the clock of tasks' CPU times, for the feature `cpu-time`: the address of a 16-bit counter that
/// runs through all its values, and two vectors that occur half a turn apart. With only one a turn, a whole
/// turn might pass between two readings.
///
/// ```ignore
/// kernel::clock_interrupts!(0x88, __vector_26, __vector_29);
/// ```
#[cfg(feature = "cpu-time")]
#[macro_export]
macro_rules! clock_interrupts {
    ($counter:expr, $one:ident, $other:ident) => {
        ::core::arch::global_asm!(
            ".global kernel_clock",
            ".set kernel_clock, {counter}",
            counter = const {
                let counter: u16 = $counter;
                counter
            },
        );
        $crate::interrupt! {
            fn $one(interrupt) { $crate::charge_in_turn(interrupt) }
            fn $other(interrupt) { $crate::charge_in_turn(interrupt) }
        }
    };
}

/// Declares the vector that drives the kernel's tick with the feature `tickless`: that of the compare unit of
/// a [`TickTimer`](crate::tickless::TickTimer). It replaces [`tick_interrupt!`](crate::tick_interrupt!).
#[cfg(feature = "tickless")]
#[macro_export]
macro_rules! tickless_interrupt {
    ($vector:ident, $timer:ty) => {
        ::core::arch::global_asm!(
            ".global kernel_needs_tick_interrupt",
            ".set kernel_needs_tick_interrupt, 0",
        );
        #[unsafe(no_mangle)]
        unsafe extern "C" fn kernel_before_sleep() {
            // SAFETY: only the idle task calls this, with interrupts masked.
            unsafe { $crate::tickless::before_sleep::<$timer>() };
        }
        #[unsafe(no_mangle)]
        unsafe extern "C" fn kernel_after_sleep() {
            // SAFETY: only the interrupt entry calls this, with interrupts masked.
            unsafe { $crate::tickless::after_sleep::<$timer>() };
        }
        $crate::interrupt! {
            fn $vector(interrupt) {
                // SAFETY: this is the timer's interrupt.
                unsafe { $crate::tickless::tick::<$timer>(interrupt) }
            }
        }
    };
}

/// Declares the vector of the trap, for [`TaskHandle::step`](crate::TaskHandle::step): an interrupt that
/// stays pending until the block disables it, and has priority over all others that are enabled meanwhile.
///
/// ```ignore
/// kernel::trap_interrupt! { fn __vector_9(interrupt) { disable_the_trap(interrupt) } }
/// ```
#[macro_export]
macro_rules! trap_interrupt {
    (fn $vector:ident($interrupt:ident) $(as $meant:path)? $body:block) => {
        $crate::assert_vector!($vector $(as $meant)?);
        #[unsafe(no_mangle)]
        #[unsafe(link_section = ".lowtext.kernel")]
        unsafe extern "C" fn $vector() -> ! {
            // Named like the vector: see `interrupt!`.
            #[inline(always)]
            fn $vector($interrupt: &mut $crate::Interrupt) $body
            {
                extern "C" fn handler() {
                    // SAFETY: only the vector calls this, with interrupts masked.
                    let interrupt = &mut unsafe { $crate::Interrupt::assume() };
                    // SAFETY: this is the trap's vector, and it has found the task.
                    if unsafe { $crate::stepped(interrupt) } {
                        $vector(interrupt);
                    }
                }
                // SAFETY: only the hardware enters here. Either nothing is changed, or
                // `kernel_enter_with_status` restores it.
                unsafe { ::core::arch::asm!(
                    "push r31",               // 2
                    "push r30",               // 2
                    "push r0",                // 2
                    "in r0, 0x3f",            // 1: SREG
                    "lds r30, {stepped}",     // 2: the low byte of the task to step
                    "lds r31, {kernel}+{running}", // 2: and of the one that runs
                    "cpse r30, r31",          // 1, or 2
                    "rjmp 1f",                // 2
                    "lds r30, {stepped}+1",   // 2: the high bytes
                    "lds r31, {kernel}+{running}+1", // 2
                    "cpse r30, r31",          // 1, or 2
                    "rjmp 1f",                // 2
                    "lds r30, {goes_on}",     // 2: has it run an instruction since the trap found it?
                    "com r30",                // 1
                    "sts {goes_on}, r30",     // 2
                    "brne 1f",                // 1, or 2: no, it runs one now
                    "ldi r30, lo8(gs({handler}))", // 1: Z = the handler, in words
                    "ldi r31, hi8(gs({handler}))", // 1
                    "rjmp {enter}",           // 2
                    "1:",
                    "out 0x3f, r0",           // 1
                    "pop r0",                 // 2
                    "pop r30",                // 2
                    "pop r31",                // 2
                    "reti",                   // 4: and one instruction of the preempted code runs
                    handler = sym handler,
                    stepped = sym $crate::STEPPED,
                    goes_on = sym $crate::GOES_ON,
                    kernel = sym $crate::KERNEL,
                    running = const $crate::arch::RUNNING,
                    enter = sym $crate::arch::kernel_enter_with_status,
                    options(noreturn),
                ) }
            }
        }
    };
}

/// Does not compile unless `$vector` is the name of a vector, and of the one that `$meant` names.
#[doc(hidden)]
#[macro_export]
macro_rules! assert_vector {
    ($vector:ident $(as $meant:path)?) => {
        const _: () = {
            let number = $crate::arch::vector_number(::core::stringify!($vector));
            ::core::assert!(number.is_some(), "a vector is `__vector_` and its number, from 1");
            $(::core::assert!(
                ::core::matches!(number, Some(number) if number == $meant as usize),
                "this is the number of another vector than the one that is meant"
            );)?
        };
    };
}

/// The number in the name of a vector: `__vector_15` is 15. 0 is the reset, and has no handler.
#[doc(hidden)]
pub const fn vector_number(name: &str) -> Option<usize> {
    let [b'_', b'_', b'v', b'e', b'c', b't', b'o', b'r', b'_', digits @ ..] = name.as_bytes() else {
        return None;
    };
    let (mut digits, mut number) = (digits, 0);
    while let [digit @ b'0'..=b'9', rest @ ..] = digits {
        if *digit == b'0' && number == 0 || number > 999 {
            return None;
        }
        number = number * 10 + (*digit - b'0') as usize;
        digits = rest;
    }
    if digits.is_empty() && number > 0 { Some(number) } else { None }
}
