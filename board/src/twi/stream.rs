//! Bytes of a packet that the vector itself sends and stores, from the START to the STOP.
//!
//! Between two bytes the interface holds SCL low until it is answered, so what an answer takes the bus takes longer: at
//! 400 kHz a byte is 360 cycles on the wire. An interrupt of the kernel would add 250 to each; this adds 41. Where a packet ends
//! as it should, the vector answers and wakes the task; what that means for the [engine](super::engine) is [settled](Ended) by whoever
//! asks it next. What the vector does not know it leaves to an interrupt of the kernel.

use kernel::MaskedCell;
use tasks::device::Transfer;

/// A part of a packet's buffer.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Stream {
    next: *const MaskedCell<u8>,
    /// Bytes that the vector may send or store from there.
    left: u8,
}

// SAFETY: it leads to cells of a static, which open in critical sections only.
unsafe impl Send for Stream {}

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

/// What the vector has ended since the engine was last asked.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(transparent)]
pub struct Ended(u8);

/// The same, for the vector.
#[doc(hidden)]
pub static ENDED: MaskedCell<Ended> = MaskedCell::new(Ended::NOTHING);

impl Ended {
    pub const NOTHING: Ended = Ended(0);
    #[doc(hidden)]
    pub const SENT: u8 = 1 << 0;
    #[doc(hidden)]
    pub const REFUSED: u8 = 1 << 1;
    #[doc(hidden)]
    pub const RECEIVED: u8 = 1 << 2;

    /// How a packet that went out has ended: its last byte was acknowledged, or its address was not.
    #[inline(always)]
    pub fn sent(self) -> Option<Transfer> {
        match self.0 & (Self::SENT | Self::REFUSED) {
            0 => None,
            Self::SENT => Some(Transfer::Done),
            _ => Some(Transfer::Refused),
        }
    }

    /// A packet of at least one byte has come, and a STOP.
    #[inline(always)]
    pub fn is_received(self) -> bool {
        self.0 & Self::RECEIVED != 0
    }
}

/// Defines the vector of the two-wire serial interface. `handler` answers what the vector does not know, `wake` follows the end of
/// a packet.
///
/// 41 cycles from the interrupt to the answer in the middle of a packet, with the interrupt's own 7, and 61 altogether.
#[doc(hidden)]
#[macro_export]
macro_rules! twi_interrupt {
    ($vector:ident, $handler:path, $wake:path) => {
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $vector() -> ! {
            extern "C" fn handler() {
                // SAFETY: only the vector calls this, with interrupts masked.
                $handler(&mut unsafe { $crate::kernel::Interrupt::assume() });
            }
            extern "C" fn wake() {
                // SAFETY: likewise.
                $wake(&mut unsafe { $crate::kernel::Interrupt::assume() });
            }
            // SAFETY: the hardware comes here. A stream lies within its packet, which is touched with interrupts masked
            // only; what is changed besides is saved, and `kernel_enter_with_status` restores all that a handler may
            // change.
            unsafe { core::arch::asm!(
                $crate::enter_vector!(),     // 7
                "lds r30, 0x71",          // 2: TWSR; the prescaler's bits in it are 0
                "cpi r30, 0x28",          // 1: a byte is sent
                "breq 2f",                // 1, or 2
                "cpi r30, 0x80",          // 1: a byte has come
                "breq 3f",                // 1, or 2
                "cpi r30, 0x18",          // 1: the address is sent
                "breq 2f",                // 1, or 2
                "cpi r30, 0x60",          // 1: the own address has come
                "breq 5f",                // 1, or 2
                "cpi r30, 0x08",          // 1: a START is sent
                "breq 9f",                // 1, or 2
                "cpi r30, 0xa0",          // 1: a STOP has come
                "brne 10f",               // 1, or 2
                "rjmp 7f",                // 2
                "10:",
                "cpi r30, 0x20",          // 1: nobody acknowledges the address
                "brne 11f",               // 1, or 2
                "rjmp 62f",               // 2
                "11:",
                "cpi r30, 0x68",          // 1: the own address has come in place of the other's
                "brne 1f",                // 1, or 2
                "rjmp 51f",               // 2
                "9:",
                "lds r30, {outgoing}+2",  // 2
                "cpi r30, 0",             // 1
                "brne 2f",                // 2, or 1: there is something to send
                "1:",
                "ldi r30, lo8(gs({handler}))", // 1
                "ldi r31, hi8(gs({handler}))", // 1
                "jmp {enter}",            // 3
                "5:",
                "lds r30, {incoming}+2",  // 2
                "cpi r30, {storable}",    // 1
                "brne 1b",                // 1: the buffer is not free
                "push r24",               // 2
                "ldi r24, {go_on}",       // 1
                "sts 0x74, r24",          // 2: TWCR
                "rjmp 4f",                // 2
                "60:",
                "rjmp 6f",                // 2
                "2:",
                "lds r30, {outgoing}+2",  // 2
                "subi r30, 1",            // 1
                "brcs 60b",               // 1, or 2: nothing is left
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
                "4:",
                "pop r24",                // 2
                $crate::leave_vector!(),     // 11
                // The packet gives way, and begins anew behind the other.
                "51:",
                "lds r30, {incoming}+2",  // 2
                "cpi r30, {storable}",    // 1
                "brne 52f",               // 1: the buffer is not free
                "push r24",               // 2
                "ldi r24, {go_on}",       // 1
                "sts 0x74, r24",          // 2: TWCR
                "lds r24, {packets}+{length}", // 2
                "sts {outgoing}+2, r24",  // 2
                "ldi r24, lo8({packets}+{packet})", // 1
                "sts {outgoing}, r24",    // 2
                "ldi r24, hi8({packets}+{packet})", // 1
                "sts {outgoing}+1, r24",  // 2
                "rjmp 4b",                // 2
                "52:",
                "rjmp 1b",                // 2
                // The packet is refused.
                "62:",
                "ldi r30, 0",             // 1: no more to be sent
                "sts {outgoing}+2, r30",  // 2
                "ldi r31, {refused}",     // 1
                "rjmp 63f",               // 2
                // The packet is sent: a STOP.
                "6:",
                "ldi r31, {sent}",        // 1
                "63:",
                "push r24",               // 2
                "ldi r24, {stop}",        // 1
                "lds r30, {incoming}+2",  // 2
                "cpi r30, {storable}",    // 1: is the buffer free?
                "brne 61f",               // 1, or 2
                "ori r24, {acknowledge}", // 1
                "61:",
                "sts 0x74, r24",          // 2: TWCR
                "lds r24, {ended}",       // 2
                "or r24, r31",            // 1
                "rjmp 8f",                // 2
                // A STOP has come.
                "7:",
                "lds r30, {incoming}+2",  // 2
                "cpi r30, {storable}",    // 1
                "brne 72f",               // 2
                "rjmp 1b",                // 2: it is a packet without a byte
                "72:",
                "push r24",               // 2
                "ldi r30, 0",             // 1: no more to be stored
                "sts {incoming}+2, r30",  // 2
                "ldi r24, {pause}",       // 1
                "lds r30, {outgoing}+2",  // 2
                "cpi r30, 0",             // 1
                "breq 71f",               // 1, or 2
                "ori r24, {start}",       // 1: a packet waits to be sent
                "71:",
                "sts 0x74, r24",          // 2: TWCR
                "lds r24, {ended}",       // 2
                "ori r24, {received}",    // 1
                "8:",
                "sts {ended}, r24",       // 2
                "pop r24",                // 2
                "ldi r30, lo8(gs({wake}))", // 1
                "ldi r31, hi8(gs({wake}))", // 1
                "jmp {enter}",            // 3
                outgoing = sym $crate::twi::stream::OUTGOING,
                incoming = sym $crate::twi::stream::INCOMING,
                ended = sym $crate::twi::stream::ENDED,
                sent = const $crate::twi::stream::Ended::SENT,
                refused = const $crate::twi::stream::Ended::REFUSED,
                received = const $crate::twi::stream::Ended::RECEIVED,
                packets = sym $crate::twi::PACKETS,
                packet = const $crate::twi::Packets::OUTGOING,
                length = const $crate::twi::Packets::LENGTH,
                go_on = const $crate::twi::registers::GO_ON,
                pause = const $crate::twi::registers::PAUSE,
                stop = const $crate::twi::registers::PAUSE | $crate::twi::registers::STOP,
                start = const $crate::twi::registers::START,
                acknowledge = const $crate::twi::registers::ACKNOWLEDGE,
                storable = const $crate::twi::engine::STORABLE,
                handler = sym handler,
                wake = sym wake,
                enter = sym $crate::kernel::arch::kernel_enter_with_status,
                options(noreturn),
            ) }
        }
    };
}
