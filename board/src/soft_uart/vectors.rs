//! The vectors of INT5 and INT7, what each edge takes, and of the end of a character.
//!
//! They come before all other interrupts, and so hold them up, the joints' periods among them: they save no more than they use, and
//! enter no kernel. Nor does Timer3's unit B where it stores the last byte before a pause. The task is woken by an interrupt of unit
//! A, an ordinary one of the kernel: the joints' periods need not wait for both.

/// Assembly that begins the joints' period if Timer2's interrupt waits for this one: 4 cycles if not. It changes r24 and r30.
#[doc(hidden)]
#[macro_export]
macro_rules! period_first {
    () => {
        concat!(
            "in r30, 0x36\n",        // 1: TIFR
            "sbrc r30, 7\n",         // 3, or 1: OCF2
            "call {begin_period}\n", // 40
        )
    };
}

/// Assembly that has unit A match at once, and interrupt: 15 cycles. It changes Z.
#[doc(hidden)]
#[macro_export]
macro_rules! raise_unit_a {
    () => {
        concat!(
            "lds r30, 0x88\n",      // 2: TCNT3L
            "lds r31, 0x89\n",      // 2: TCNT3H
            "adiw r30, 16\n",       // 2
            "sts 0x87, r31\n",      // 2: OCR3AH
            "sts 0x86, r30\n",      // 2: OCR3AL
            "lds r30, 0x7d\n",      // 2: ETIMSK
            "ori r30, {match_a}\n", // 1
            "sts 0x7d, r30\n",      // 2
        )
    };
}

/// Defines the three vectors.
#[doc(hidden)]
#[macro_export]
macro_rules! soft_uart_interrupts {
    () => {
        /// INT5: a pulse has begun, so the next one can be set: 60 cycles, with the interrupt's own 7, and 6 for each bit of the
        /// pulse; 28 more where it ends a byte.
        #[unsafe(no_mangle)]
        unsafe extern "C" fn __vector_6() -> ! {
            // SAFETY: the hardware comes here. The line's state is touched with interrupts masked only; what is changed besides
            // is saved.
            unsafe { core::arch::asm!(
                $crate::enter_vector!(),     // 7
                "push r24",                   // 2
                "push r25",                   // 2
                $crate::period_first!(),      // 4
                "lds r30, {encoder}",         // 2: Z = the bits that no pulse was made of yet
                "lds r31, {encoder}+1",       // 2
                "adiw r30, 0",                // 2
                "breq 6f",                    // 1: none
                "ldi r24, lo8({bit}-1)",      // 1: r25:r24 = the clocks that the line is low, less one
                "ldi r25, hi8({bit}-1)",      // 1
                "rjmp 3f",                    // 2
                "2:",
                "subi r24, lo8(-({bit}))",      // 1: a low bit
                "sbci r25, hi8(-({bit}))",      // 1
                "3:",
                "lsr r31",                    // 1
                "ror r30",                    // 1
                "brcc 2b",                    // 2, or 1
                "sts 0x83, r25",              // 2: OCR3CH
                "sts 0x82, r24",              // 2: OCR3CL
                "4:",
                "subi r24, lo8(-({bit}))",      // 1: a high bit
                "sbci r25, hi8(-({bit}))",      // 1
                "lsr r31",                    // 1
                "ror r30",                    // 1
                "brcs 4b",                    // 2, or 1
                "adiw r30, 0",                // 2: was that the stop bit?
                "breq 7f",                    // 1, or 2
                "sts 0x87, r25",              // 2: OCR3AH
                "sts 0x86, r24",              // 2: OCR3AL
                "5:",
                "sts {encoder}, r30",         // 2
                "sts {encoder}+1, r31",       // 2
                "6:",
                "pop r25",                    // 2
                "pop r24",                    // 2
                $crate::leave_vector!(),     // 11
                "7:",
                "lds r30, {port}+{left}",     // 2: Z = the bytes left
                "lds r31, {port}+{left}+1",   // 2
                "sbiw r30, 1",                // 2
                "brcs 8f",                    // 1, or 2
                "sts {port}+{left}, r30",     // 2
                "sts {port}+{left}+1, r31",   // 2
                "sts 0x87, r25",              // 2: OCR3AH
                "sts 0x86, r24",              // 2: OCR3AL
                "lds r30, {port}+{next}",     // 2: Z = the byte's address
                "lds r31, {port}+{next}+1",   // 2
                "ld r24, Z+",                 // 2
                "sts {port}+{next}, r30",     // 2
                "sts {port}+{next}+1, r31",   // 2
                "mov r30, r24",               // 1: Z = the byte's bits, and
                "ldi r31, hi8({stop})",       // 1: its stop bit
                "rjmp 5b",                    // 2
                // The last pulse: unit B matches at its end, and the line stays high.
                "8:",
                "sts 0x85, r25",              // 2: OCR3BH
                "sts 0x84, r24",              // 2: OCR3BL
                "ldi r24, 0xff",              // 1
                "sts 0x87, r24",              // 2: OCR3AH
                "sts 0x86, r24",              // 2: OCR3AL
                "lds r24, 0x7d",              // 2: ETIMSK
                "ori r24, {match_b}",         // 1
                "sts 0x7d, r24",              // 2
                "ldi r30, 0",                 // 1: no bits
                "ldi r31, 0",                 // 1
                "rjmp 5b",                    // 2
                begin_period = sym $crate::joints::begin_period,
                encoder = sym $crate::soft_uart::ENCODER,
                bit = const $crate::soft_uart::BIT,
                stop = const $crate::soft_uart::encoder::STOP,
                port = sym $crate::soft_uart::PORT,
                next = const $crate::serial::outbox::offset::NEXT,
                left = const $crate::serial::outbox::offset::LEFT,
                match_b = const $crate::soft_uart::registers::MATCH_B,
                options(noreturn),
            ) }
        }

        /// INT7: the line has changed. With the interrupt's own 7, where it has
        ///
        /// - risen: 87 cycles, and 7 for each low bit of the byte;
        /// - fallen within a character: 93 cycles, and 5 for each high bit;
        /// - fallen after one: 131 cycles, 17 more where the task is to be woken;
        /// - fallen after a pause: 108 cycles.
        #[unsafe(no_mangle)]
        unsafe extern "C" fn __vector_8() -> ! {
            // SAFETY: the hardware comes here. The line's state is touched with interrupts masked only; what is changed besides
            // is saved.
            unsafe { core::arch::asm!(
                $crate::enter_vector!(),     // 7
                "push r24",                   // 2
                "push r25",                   // 2
                $crate::period_first!(),      // 4
                "lds r30, 0x7c",              // 2: ETIFR
                "sbrs r30, {captured}",       // 2: ICF3
                "rjmp 7f",                    // 2: not the edge that was expected
                "20:",
                "lds r24, 0x80",              // 2: ICR3L: r25:r24 = when it came
                "lds r25, 0x81",              // 2: ICR3H
                "26:",
                "lds r30, {decoder}+{is_busy}", // 2
                "lds r31, 0x8a",              // 2: TCCR3B
                "sbrs r31, {rising}",         // 2, or 1: ICES3
                "rjmp 5f",                    // 2
                // The line has risen.
                "ldi r31, {expect_falling}",  // 1
                "sts 0x8a, r31",              // 2: TCCR3B
                "ldi r31, 1 << {captured}",   // 1
                "sts 0x7c, r31",              // 2: ETIFR
                "tst r30",                    // 1
                "breq 25f",                   // 1: not in a character
                "lds r30, {decoder}+{last}",  // 2: Z = when the low bits began
                "lds r31, {decoder}+{last}+1", // 2
                "sts {decoder}+{last}, r24",  // 2
                "sts {decoder}+{last}+1, r25", // 2
                "sub r24, r30",               // 1: r25:r24 = how long ago, and half a bit
                "sbc r25, r31",               // 1
                "subi r24, lo8(-({half}))",     // 1
                "sbci r25, hi8(-({half}))",     // 1
                "brmi 4f",                    // 1: too short for a start bit
                "lds r30, {decoder}+{byte}",  // 2
                "lds r31, {decoder}+{next}",  // 2
                "tst r31",                    // 1
                "breq 3f",                    // 1
                "rjmp 22f",                   // 2
                "21:",
                "eor r30, r31",               // 1: a low bit of the byte
                "lsl r31",                    // 1
                "breq 3f",                    // 1: it was the last
                "22:",
                "subi r24, lo8({bit})",       // 1
                "sbci r25, hi8({bit})",       // 1
                "brcc 21b",                   // 2, or 1
                "2:",
                "sts {decoder}+{byte}, r30",  // 2
                "sts {decoder}+{next}, r31",  // 2
                "23:",
                "sbis 0x01, 7",               // 2: PINE: is it high still?
                "rjmp 7f",                    // 2
                "24:",
                "pop r25",                    // 2
                "pop r24",                    // 2
                $crate::leave_vector!(),     // 11
                "3:",
                "subi r24, lo8({bit})",       // 1: a low bit more?
                "sbci r25, hi8({bit})",       // 1
                "brcs 2b",                    // 2
                $crate::lose!(),              // there is no stop bit
                "4:",
                "ldi r30, 0",                 // 1
                "sts {decoder}+{is_busy}, r30", // 2
                "rjmp 23b",                   // 2
                "25:",
                "sts {decoder}+{last}, r24",  // 2
                "sts {decoder}+{last}+1, r25", // 2
                "rjmp 23b",                   // 2
                // The line has fallen.
                "5:",
                "ldi r31, {expect_rising}",   // 1
                "sts 0x8a, r31",              // 2: TCCR3B
                "ldi r31, 1 << {captured}",   // 1
                "sts 0x7c, r31",              // 2: ETIFR
                "tst r30",                    // 1
                "breq 53f",                   // 1: not in a character
                "lds r30, {decoder}+{ends_at}", // 2
                "lds r31, {decoder}+{ends_at}+1", // 2
                "subi r30, lo8({bit})",       // 1
                "sbci r31, hi8({bit})",       // 1
                "cp r24, r30",                // 1
                "cpc r25, r31",               // 1
                "brpl 54f",                   // 1: the character has ended
                "lds r30, {decoder}+{last}",  // 2: Z = when the high bits began
                "lds r31, {decoder}+{last}+1", // 2
                "sts {decoder}+{last}, r24",  // 2
                "sts {decoder}+{last}+1, r25", // 2
                "sub r24, r30",               // 1: r25:r24 = how long ago, and half a bit
                "sbc r25, r31",               // 1
                "subi r24, lo8(-({half}))",     // 1
                "sbci r25, hi8(-({half}))",     // 1
                "lds r30, {decoder}+{next}",  // 2
                "rjmp 52f",                   // 2
                "51:",
                "lsl r30",                    // 1: a high bit
                "52:",
                "subi r24, lo8({bit})",       // 1
                "sbci r25, hi8({bit})",       // 1
                "brcc 51b",                   // 2, or 1
                "sts {decoder}+{next}, r30",  // 2
                "56:",
                "sbic 0x01, 7",               // 2: PINE: is it low still?
                "rjmp 7f",                    // 2
                "rjmp 24b",                   // 2
                // After a pause.
                "53:",
                "ldi r30, 1",                 // 1
                "sts {decoder}+{is_busy}, r30", // 2
                "lds r30, 0x7d",              // 2: ETIMSK
                "ori r30, {match_b}",         // 1
                "sts 0x7d, r30",              // 2
                "clt",                        // 1: no character before
                "rjmp 55f",                   // 2
                "54:",
                "set",                        // 1: there is one
                // A character begins.
                "55:",
                "subi r24, lo8(-({bit}))",      // 1: r25:r24 = when its start bit ends
                "sbci r25, hi8(-({bit}))",      // 1
                "sts {decoder}+{last}, r24",  // 2
                "sts {decoder}+{last}+1, r25", // 2
                "subi r24, lo8(-({rest}))",     // 1: r25:r24 = when it ends
                "sbci r25, hi8(-({rest}))",     // 1
                "sts {decoder}+{ends_at}, r24", // 2
                "sts {decoder}+{ends_at}+1, r25", // 2
                "sts 0x85, r25",              // 2: OCR3BH
                "sts 0x84, r24",              // 2: OCR3BL
                "ldi r30, {match_b}",         // 1: forgets a match for the one before
                "sts 0x7c, r30",              // 2: ETIFR
                $crate::tick!(),              // 5
                "lds r24, {decoder}+{byte}",  // 2: r24 = the byte before
                "ldi r30, 0xff",              // 1
                "sts {decoder}+{byte}, r30",  // 2
                "ldi r30, 1",                 // 1
                "sts {decoder}+{next}, r30",  // 2
                "brts 57f",                   // 2, or 1
                // After a pause. The byte before should have been a frame's last.
                "lds r24, {inbox}+{last_byte}", // 2
                "tst r24",                    // 1
                "breq 56b",                   // 2, or 1
                $crate::is_in_time!(),        // 10
                "brlo 56b",                   // 2, or 1
                "ldi r24, 0",                 // 1: the rest of its frame does not come any more
                "57:",
                $crate::store!(),             // 28
                "rjmp 56b",                   // 2
                "9:",
                $crate::lose!(),
                "8:",
                $crate::raise_unit_a!(),      // 15
                "rjmp 56b",                   // 2
                // The line may have changed twice since its change was looked for.
                "7:",
                "lds r30, 0x7c",              // 2: ETIFR
                "sbrc r30, {captured}",       // 1, or 2: ICF3
                "rjmp 20b",                   // 2: that was seen
                "lds r24, {decoder}+{last}",  // 2: r25:r24 = the edge before
                "lds r25, {decoder}+{last}+1", // 2
                "lds r31, 0x8a",              // 2: TCCR3B
                "sbrs r31, {rising}",         // 2, or 1: ICES3
                "rjmp 71f",                   // 2
                "sbis 0x01, 7",               // 2, or 1: PINE
                "rjmp 24b",                   // 2: it has not changed
                "lds r30, {decoder}+{ends_at}", // 2
                "lds r31, {decoder}+{ends_at}+1", // 2
                "subi r30, lo8({rest})",      // 1
                "sbci r31, hi8({rest})",      // 1
                "cp r24, r30",                // 1
                "cpc r25, r31",               // 1
                "breq 73f",                   // 2, or 1: that began a character, and its start bit ends there
                "72:",
                "subi r24, lo8(-({bit}))",    // 1: a bit later
                "sbci r25, hi8(-({bit}))",    // 1
                "73:",
                "rjmp 26b",                   // 2
                "71:",
                "sbic 0x01, 7",               // 2, or 1: PINE
                "rjmp 24b",                   // 2: it has not changed
                "rjmp 72b",                   // 2
                begin_period = sym $crate::joints::begin_period,
                captured = const $crate::soft_uart::registers::CAPTURED,
                rising = const $crate::soft_uart::registers::RISING,
                expect_falling = const $crate::soft_uart::registers::EXPECT_FALLING,
                expect_rising = const $crate::soft_uart::registers::EXPECT_RISING,
                match_a = const $crate::soft_uart::registers::MATCH_A,
                match_b = const $crate::soft_uart::registers::MATCH_B,
                decoder = sym $crate::soft_uart::DECODER,
                last = const $crate::soft_uart::decoder::offset::LAST,
                ends_at = const $crate::soft_uart::decoder::offset::ENDS_AT,
                byte = const $crate::soft_uart::decoder::offset::BYTE,
                next = const $crate::soft_uart::decoder::offset::NEXT,
                is_busy = const $crate::soft_uart::decoder::offset::IS_BUSY,
                bit = const $crate::soft_uart::BIT,
                half = const $crate::soft_uart::BIT / 2,
                rest = const $crate::soft_uart::END - $crate::soft_uart::BIT,
                kernel = sym $crate::kernel::KERNEL,
                tick = const $crate::kernel::NEXT,
                ticks_left = sym $crate::kernel::TICKS_LEFT,
                inbox = sym $crate::soft_uart::PORT,
                first = const $crate::serial::inbox::offset::FIRST,
                end = const $crate::serial::inbox::offset::END,
                wakes_at = const $crate::serial::inbox::offset::WAKES_AT,
                last_byte = const $crate::serial::inbox::offset::LAST_BYTE,
                heard_at = const $crate::serial::inbox::offset::HEARD_AT,
                lost = const $crate::serial::inbox::offset::LOST,
                around = const $crate::serial::inbox::AROUND,
                pause = const $crate::serial::inbox::PAUSE,
                options(noreturn),
            ) }
        }

        /// "Timer/Counter3 Compare Match B": a character has ended and no other has begun. Or the last stop bit sent is on the
        /// wire, or the line is held low: that is for the handler.
        #[unsafe(no_mangle)]
        unsafe extern "C" fn __vector_27() -> ! {
            extern "C" fn ended() {
                // SAFETY: only the vector calls this, with interrupts masked.
                $crate::soft_uart::ended(&mut unsafe { $crate::kernel::Interrupt::assume() });
            }
            // SAFETY: as for the vector before, and `kernel_enter_with_status` restores all that a handler may change.
            unsafe { core::arch::asm!(
                $crate::enter_vector!(),     // 7
                "push r24",                   // 2
                "push r25",                   // 2
                "lds r24, {decoder}+{is_busy}", // 2
                "tst r24",                    // 1
                "breq 7f",                    // 1, or 2
                "lds r24, 0x8a",              // 2: TCCR3B
                "sbrc r24, {rising}",         // 2, or 1: ICES3: the line is low?
                "rjmp 7f",                    // 2
                $crate::is_in_time!(),        // 10
                "brsh 6f",                    // 1, or 2
                "2:",
                "ldi r24, 0",                 // 1
                "sts {decoder}+{is_busy}, r24", // 2
                "lds r24, 0x7d",              // 2: ETIMSK
                "andi r24, 0xff - {match_b}", // 1
                "sts 0x7d, r24",              // 2
                "lds r24, {decoder}+{byte}",  // 2
                $crate::store!(),             // 28
                "3:",
                "pop r25",                    // 2
                "pop r24",                    // 2
                $crate::leave_vector!(),     // 11
                // After a pause. The byte before should have been a frame's last.
                "6:",
                "lds r24, {inbox}+{last_byte}", // 2
                "tst r24",                    // 1
                "breq 2b",                    // 1, or 2
                "7:",
                "ldi r30, lo8(gs({ended}))",  // 1
                "ldi r31, hi8(gs({ended}))",  // 1
                "pop r25",                    // 2
                "pop r24",                    // 2
                "jmp {enter}",                // 3
                "9:",
                $crate::lose!(),
                "8:",
                $crate::raise_unit_a!(),      // 15
                "rjmp 3b",                    // 2
                rising = const $crate::soft_uart::registers::RISING,
                match_a = const $crate::soft_uart::registers::MATCH_A,
                match_b = const $crate::soft_uart::registers::MATCH_B,
                decoder = sym $crate::soft_uart::DECODER,
                byte = const $crate::soft_uart::decoder::offset::BYTE,
                is_busy = const $crate::soft_uart::decoder::offset::IS_BUSY,
                kernel = sym $crate::kernel::KERNEL,
                tick = const $crate::kernel::NEXT,
                ticks_left = sym $crate::kernel::TICKS_LEFT,
                inbox = sym $crate::soft_uart::PORT,
                first = const $crate::serial::inbox::offset::FIRST,
                end = const $crate::serial::inbox::offset::END,
                wakes_at = const $crate::serial::inbox::offset::WAKES_AT,
                last_byte = const $crate::serial::inbox::offset::LAST_BYTE,
                heard_at = const $crate::serial::inbox::offset::HEARD_AT,
                lost = const $crate::serial::inbox::offset::LOST,
                around = const $crate::serial::inbox::AROUND,
                pause = const $crate::serial::inbox::PAUSE,
                ended = sym ended,
                enter = sym $crate::kernel::arch::kernel_enter_with_status,
                options(noreturn),
            ) }
        }
    };
}
