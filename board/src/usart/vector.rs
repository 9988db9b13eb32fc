//! The vectors of "USART, Rx Complete" and "USART, Data Register Empty": in the middle of a frame they store or send the byte
//! themselves.
//!
//! An interrupt of the kernel would take more than twice as long, for each byte of each line. The kernel is entered only at the
//! end of a frame, and where something is wrong.

/// Defines the vector of a byte that has come, for the USART with UCSRnA and UDRn at the addresses `status` and `data`.
///
/// 78 cycles in the middle of a frame, with the interrupt's own 7.
#[doc(hidden)]
#[macro_export]
macro_rules! receive_interrupt {
    ($vector:ident, $usart:ty, $port:path, $status:literal, $data:literal) => {
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $vector() -> ! {
            extern "C" fn receive() {
                // SAFETY: only the vector calls this, with interrupts masked.
                $crate::usart::receive_complete::<$usart>(&mut unsafe { $crate::kernel::Interrupt::assume() });
            }
            extern "C" fn wake() {
                // SAFETY: likewise.
                $port.wake(&mut unsafe { $crate::kernel::Interrupt::assume() });
            }
            // SAFETY: the hardware comes here. The inbox is touched with interrupts masked only; what is changed besides is
            // saved, and `kernel_enter_with_status` restores all that a handler may change.
            unsafe { core::arch::asm!(
                $crate::enter_vector!(),     // 7
                "push r24",                // 2
                "push r25",                // 2
                "lds r24, {status}",       // 2: of the byte in UDRn, so read before it
                "andi r24, {errors}",      // 1
                "brne 7f",                 // 1, or 2
                $crate::is_in_time!(),     // 10
                "brsh 6f",                 // 1, or 2
                "2:",
                "lds r24, {data}",         // 2
                $crate::store!(),          // 28
                "pop r25",                 // 2
                "pop r24",                 // 2
                $crate::leave_vector!(),     // 11
                // After a pause. The byte before should have been a frame's last.
                "6:",
                "lds r24, {inbox}+{last_byte}", // 2
                "tst r24",                 // 1
                "breq 2b",                 // 1, or 2
                // To a handler.
                "7:",
                "ldi r30, lo8(gs({receive}))", // 1
                "ldi r31, hi8(gs({receive}))", // 1
                "rjmp 3f",                 // 2
                "9:",
                $crate::lose!(),
                "8:",
                "ldi r30, lo8(gs({wake}))", // 1
                "ldi r31, hi8(gs({wake}))", // 1
                "3:",
                "pop r25",                 // 2
                "pop r24",                 // 2
                "jmp {enter}",             // 3
                status = const $status,
                data = const $data,
                errors = const $crate::usart::ERRORS,
                kernel = sym $crate::kernel::KERNEL,
                tick = const $crate::kernel::NEXT,
                ticks_left = sym $crate::kernel::TICKS_LEFT,
                inbox = sym $port,
                first = const $crate::serial::inbox::offset::FIRST,
                end = const $crate::serial::inbox::offset::END,
                wakes_at = const $crate::serial::inbox::offset::WAKES_AT,
                last_byte = const $crate::serial::inbox::offset::LAST_BYTE,
                heard_at = const $crate::serial::inbox::offset::HEARD_AT,
                lost = const $crate::serial::inbox::offset::LOST,
                around = const $crate::serial::inbox::AROUND,
                pause = const $crate::serial::inbox::PAUSE,
                receive = sym receive,
                wake = sym wake,
                enter = sym $crate::kernel::arch::kernel_enter_with_status,
                options(noreturn),
            ) }
        }
    };
}

/// Defines the vector of a byte that may be sent, for the USART with UDRn at the address `data`.
///
/// 54 cycles in the middle of a frame, with the interrupt's own 7.
#[doc(hidden)]
#[macro_export]
macro_rules! transmit_interrupt {
    ($vector:ident, $usart:ty, $port:path, $data:literal) => {
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $vector() -> ! {
            extern "C" fn end() {
                // SAFETY: only the vector calls this, with interrupts masked.
                $crate::usart::data_register_empty::<$usart>(&mut unsafe { $crate::kernel::Interrupt::assume() });
            }
            // SAFETY: the hardware comes here. The outbox, which holds so many bytes as it says, is touched with interrupts masked
            // only; what is changed besides is saved, and `kernel_enter_with_status` restores all that a handler may change.
            unsafe { core::arch::asm!(
                $crate::enter_vector!(),     // 7
                "push r24",                // 2
                "lds r30, {port}+{left}",  // 2: Z = the bytes left
                "lds r31, {port}+{left}+1", // 2
                "sbiw r30, 2",             // 2
                "brcs 2f",                 // 1, or 2: the last, or none
                "adiw r30, 1",             // 2
                "sts {port}+{left}, r30",  // 2
                "sts {port}+{left}+1, r31", // 2
                "lds r30, {port}+{next}",  // 2: Z = the byte's address
                "lds r31, {port}+{next}+1", // 2
                "ld r24, Z+",              // 2
                "sts {data}, r24",         // 2
                "sts {port}+{next}, r30",  // 2
                "sts {port}+{next}+1, r31", // 2
                "pop r24",                 // 2
                $crate::leave_vector!(),     // 11
                "2:",
                "pop r24",                 // 2
                "ldi r30, lo8(gs({end}))", // 1
                "ldi r31, hi8(gs({end}))", // 1
                "jmp {enter}",             // 3
                data = const $data,
                port = sym $port,
                next = const $crate::serial::outbox::offset::NEXT,
                left = const $crate::serial::outbox::offset::LEFT,
                end = sym end,
                enter = sym $crate::kernel::arch::kernel_enter_with_status,
                options(noreturn),
            ) }
        }
    };
}
