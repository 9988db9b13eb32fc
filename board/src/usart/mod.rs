//! The two USARTs: serial links of frames that end in a zero byte.
//!
//! Receiving costs an interrupt a byte, but wakes the task only at a frame's end or when the FIFO is full.
//! Sending hands the whole slice to the interrupt; the task sleeps until the last stop bit is on the wire.

mod io;
mod registers;

use core::marker::PhantomData;
use core::{ptr, slice};

use kernel::{Context, Fifo, Interrupt, MaskedCell, Semaphore, Task};
use tasks::device::{Receive, Transmit};

pub use registers::{Usart, Usart0, Usart1};

use crate::interrupts::Serves;
use crate::superbot::{BAUD, CLOCK_HZ};
use registers::{DATA_OVERRUN, DOUBLE_SPEED, FINISHING, FRAME_ERROR, RECEIVING, SENDING, TRANSMIT_COMPLETE};

/// UBRRn at double speed: the nearest to 8 * BAUD clocks a bit, less one.
const DIVISOR: u16 = {
    let divisor = (CLOCK_HZ + 4 * BAUD) / (8 * BAUD) - 1;
    assert!(divisor < 1 << 12, "the baud rate is too low for UBRR");
    divisor as u16
};

/// What the tasks and the interrupts of a USART share.
#[doc(hidden)]
pub struct Port {
    received: Fifo<32>,
    is_readable: Semaphore,
    /// Whether to post `is_readable` at any byte, for a reader that knows no frames.
    is_stream: MaskedCell<bool>,
    /// Bytes with framing errors, overruns of the hardware's two-byte buffer, frames that did not fit.
    lost: MaskedCell<u16>,
    unsent: MaskedCell<&'static [u8]>,
    is_sent: Semaphore,
}

impl Port {
    const fn new() -> Self {
        Port {
            received: Fifo::new(),
            is_readable: Semaphore::new(0),
            is_stream: MaskedCell::new(false),
            lost: MaskedCell::new(0),
            unsent: MaskedCell::new(&[]),
            is_sent: Semaphore::new(0),
        }
    }
}

/// The sending half of a USART.
pub struct Transmitter<U> {
    usart: PhantomData<U>,
}

/// The receiving half of a USART.
pub struct Receiver<U> {
    usart: PhantomData<U>,
}

macro_rules! start {
    ($($Usart:ident)+) => {$(
        impl $Usart {
            /// Starts the USART at [`BAUD`], full duplex.
            pub fn start(self, _: impl Serves<$Usart>) -> (Transmitter<$Usart>, Receiver<$Usart>) {
                $Usart::set_baud(DIVISOR);
                $Usart::set_status(DOUBLE_SPEED);
                $Usart::set_control(RECEIVING);
                (Transmitter { usart: PhantomData }, Receiver { usart: PhantomData })
            }
        }
    )+};
}
start!(Usart0 Usart1);

impl<U: Usart> Transmit for Transmitter<U> {
    fn transmit(&mut self, task: &mut Task, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        // SAFETY: the interrupt posts `is_sent` only when it has read all of `bytes`, and this call, which
        // borrows them, does not return before.
        let bytes = unsafe { slice::from_raw_parts(ptr::from_ref(bytes).cast(), bytes.len()) };
        task.mask(|masked| U::port().unsent.set(masked, bytes));
        U::set_control(SENDING);
        U::port().is_sent.wait(task);
    }
}

impl<U: Usart> Receive for Receiver<U> {
    fn receive(&mut self, task: &mut Task, buffer: &mut [u8]) -> usize {
        let port = U::port();
        let mut length = 0usize;
        loop {
            while let Some(byte) = port.received.take(task) {
                if let Some(slot) = buffer.get_mut(length) {
                    *slot = byte;
                }
                length = length.saturating_add(1);
                if byte == 0 {
                    if length <= buffer.len() {
                        return length;
                    }
                    task.mask(|masked| port.lost.count(masked));
                    length = 0;
                }
            }
            port.is_readable.wait(task);
        }
    }

    fn overruns(&self, task: &mut Task) -> u16 {
        let port = U::port();
        let lost = task.mask(|masked| port.lost.get(masked));
        lost.saturating_add(port.received.overruns(task))
    }
}

impl<U: Usart> Receiver<U> {
    /// Blocks until a byte has come, and copies what has come to the start of `buffer`. Returns how many
    /// bytes; 0 only if `buffer` is empty.
    fn read(&mut self, task: &mut Task, buffer: &mut [u8]) -> usize {
        if buffer.is_empty() {
            return 0;
        }
        let port = U::port();
        task.mask(|masked| port.is_stream.set(masked, true));
        let length = loop {
            let mut length = 0;
            for slot in buffer.iter_mut() {
                let Some(byte) = port.received.take(task) else { break };
                *slot = byte;
                length += 1;
            }
            if length > 0 {
                break length;
            }
            port.is_readable.wait(task);
        };
        task.mask(|masked| port.is_stream.set(masked, false));
        length
    }
}

/// The interrupt "USART, Rx Complete".
#[doc(hidden)]
#[inline(always)]
pub fn receive_complete<U: Usart>(interrupt: &mut Interrupt) {
    let port = U::port();
    let status = U::status(); // of the byte in UDRn, so read before it
    let byte = U::data();
    if status & (FRAME_ERROR | DATA_OVERRUN) != 0 {
        interrupt.mask(|masked| port.lost.count(masked));
        if status & FRAME_ERROR != 0 {
            return; // no byte: a line held low must not look like a stream of ends of frames
        }
    }
    let space = port.received.put(interrupt, byte);
    if byte == 0 || space == Some(0) || interrupt.mask(|masked| port.is_stream.get(masked)) {
        port.is_readable.post(interrupt);
    }
}

/// The interrupt "USART, Data Register Empty".
#[doc(hidden)]
#[inline(always)]
pub fn data_register_empty<U: Usart>(interrupt: &mut Interrupt) {
    interrupt.mask(|masked| {
        let unsent = &U::port().unsent;
        let Some((byte, rest)) = unsent.get(masked).split_first() else {
            return U::set_control(RECEIVING);
        };
        U::set_data(*byte);
        unsent.set(masked, rest);
        if rest.is_empty() {
            // The flag may stand from the byte before. Cleared now it can only come from the last one,
            // which takes a frame's time from here.
            U::set_status(DOUBLE_SPEED | TRANSMIT_COMPLETE);
            U::set_control(FINISHING);
        }
    });
}

/// The interrupt "USART, Tx Complete".
#[doc(hidden)]
#[inline(always)]
pub fn transmit_complete<U: Usart>(interrupt: &mut Interrupt) {
    U::set_control(RECEIVING);
    U::port().is_sent.post(interrupt);
}
