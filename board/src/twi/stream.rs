//! Bytes of a packet that the vector itself sends and stores, from the START to the last but one.
//!
//! Between two bytes the interface holds SCL low until it is answered, so what an answer takes the bus takes longer: at
//! 400 kHz a byte is 360 cycles on the wire. An interrupt of the kernel would add 250 to each; this adds 41. What it does
//! not know it leaves to an interrupt of the kernel.

use kernel::MaskedCell;

/// A part of a packet's buffer.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Stream {
    next: *const MaskedCell<u8>,
    /// Bytes that the vector may send or store from there.
    left: u8,
}

/// What the vector sends from.
#[doc(hidden)]
pub static OUTGOING: MaskedCell<Stream> = MaskedCell::new(Stream::NONE);
/// What the vector stores to.
#[doc(hidden)]
pub static INCOMING: MaskedCell<Stream> = MaskedCell::new(Stream::NONE);

impl Stream {
    const NONE: Stream = Stream { next: core::ptr::null(), left: 0 };

    /// The stream of `left` bytes of `packet` from `index` on.
    #[inline(always)]
    pub fn new(packet: &'static [MaskedCell<u8>], index: u8, left: u8) -> Stream {
        match packet.get(usize::from(index)..usize::from(index) + usize::from(left)) {
            Some(part) => Stream { next: part.as_ptr(), left },
            None => Stream::NONE,
        }
    }

    /// The index in `packet` to which this stream has come.
    #[inline(always)]
    pub fn index(self, packet: &'static [MaskedCell<u8>]) -> u8 {
        (self.next.addr() as u8).wrapping_sub(packet.as_ptr().addr() as u8)
    }
}

/// Defines the vector of the two-wire serial interface. `handler` answers what is not the middle of a packet.
///
/// 41 cycles from the interrupt to the answer in the middle of a packet, with the interrupt's own 7, and 61 altogether.
#[doc(hidden)]
#[macro_export]
macro_rules! twi_interrupt {
    ($vector:ident, $handler:path) => {
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $vector() -> ! {
            extern "C" fn handler() {
                // SAFETY: only the vector calls this, with interrupts masked.
                $handler(&mut unsafe { $crate::kernel::Interrupt::assume() });
            }
            // SAFETY: the hardware comes here. A stream lies within its packet, which is touched with interrupts masked
            // only; what is changed besides is saved, and `kernel_enter_interrupt` restores all that the handler may
            // change.
            unsafe { core::arch::asm!(
                "push r31",               // 2
                "push r30",               // 2
                "in r30, 0x3f",           // 1: SREG
                "push r30",               // 2
                "lds r30, 0x71",          // 2: TWSR; the prescaler's bits in it are 0
                "cpi r30, 0x28",          // 1: a byte is sent
                "breq 2f",                // 1, or 2
                "cpi r30, 0x80",          // 1: a byte has come
                "breq 3f",                // 1, or 2
                "cpi r30, 0x18",          // 1: the address is sent
                "breq 2f",                // 1, or 2
                "cpi r30, 0x08",          // 1: a START is sent
                "breq 2f",                // 1, or 2
                "cpi r30, 0x60",          // 1: the own address has come
                "breq 5f",                // 1, or 2
                "1:",
                "pop r30",                // 2
                "out 0x3f, r30",          // 1: as the interrupt found it
                "ldi r30, lo8(gs({handler}))", // 1
                "ldi r31, hi8(gs({handler}))", // 1
                "jmp {enter}",            // 3
                "2:",
                "lds r30, {outgoing}+2",  // 2
                "subi r30, 1",            // 1
                "brcs 1b",                // 1: nothing is left
                "sts {outgoing}+2, r30",  // 2
                "push r24",               // 2
                "lds r30, {outgoing}",    // 2
                "lds r31, {outgoing}+1",  // 2
                "ld r24, Z+",             // 2
                "sts 0x73, r24",          // 2: TWDR
                "ldi r24, {go_on}",       // 1
                "sts 0x74, r24",          // 2: TWCR
                "sts {outgoing}, r30",    // 2
                "sts {outgoing}+1, r31",  // 2
                "rjmp 4f",                // 2
                "3:",
                "lds r30, {incoming}+2",  // 2
                "subi r30, 1",            // 1
                "brcs 1b",                // 1
                "sts {incoming}+2, r30",  // 2
                "push r24",               // 2
                "lds r30, {incoming}",    // 2
                "lds r31, {incoming}+1",  // 2
                "lds r24, 0x73",          // 2: TWDR
                "st Z+, r24",             // 2
                "ldi r24, {go_on}",       // 1
                "sts 0x74, r24",          // 2: TWCR
                "sts {incoming}, r30",    // 2
                "sts {incoming}+1, r31",  // 2
                "rjmp 4f",                // 2
                "5:",
                "lds r30, {incoming}+2",  // 2
                "cpi r30, {storable}",    // 1
                "brne 1b",                // 1: the buffer is not free
                "push r24",               // 2
                "ldi r24, {go_on}",       // 1
                "sts 0x74, r24",          // 2: TWCR
                "4:",
                "pop r24",                // 2
                "pop r30",                // 2
                "out 0x3f, r30",          // 1
                "pop r30",                // 2
                "pop r31",                // 2
                "reti",                   // 4
                outgoing = sym $crate::twi::stream::OUTGOING,
                incoming = sym $crate::twi::stream::INCOMING,
                go_on = const $crate::twi::GO_ON,
                storable = const $crate::twi::engine::STORABLE,
                handler = sym handler,
                enter = sym $crate::kernel::arch::kernel_enter_interrupt,
                options(noreturn),
            ) }
        }
    };
}
