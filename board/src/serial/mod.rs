//! Serial lines: what the tasks of a USART, or of the UART in software, share with its interrupts.
//!
//! A line carries frames that end in a zero byte. A byte that comes in wakes the task only at a frame's end or
//! when the FIFO is full. To send, the task hands over the whole slice, and sleeps until the last stop bit is on
//! the wire.
//!
//! What light carries is half duplex: two ends that send at once drown each other, and an end may hear its own
//! reflection.

mod io;

use core::marker::PhantomData;
use core::{ptr, slice};

use kernel::{Context, Fifo, Interrupt, Masked, MaskedCell, Semaphore, Task};
use tasks::device::{Receive, Transmit};

/// A line, named by its type.
pub trait Line {
    /// What its tasks and interrupts share.
    #[doc(hidden)]
    fn port() -> &'static Port;

    /// Begins to send what the port has to send, at least one byte.
    #[doc(hidden)]
    fn begin(task: &mut Task);
}

/// What the tasks and the interrupts of a line share.
#[doc(hidden)]
pub struct Port {
    received: Fifo<32>,
    is_readable: Semaphore,
    /// Whether the byte that came last was within a frame.
    is_in_frame: MaskedCell<bool>,
    /// Whether to post `is_readable` at any byte, for a reader that knows no frames.
    is_stream: MaskedCell<bool>,
    /// Bytes with framing errors, bytes lost before the FIFO, frames that did not fit.
    lost: MaskedCell<u16>,
    unsent: MaskedCell<&'static [u8]>,
    is_sent: Semaphore,
}

impl Port {
    pub(crate) const fn new() -> Self {
        Port {
            received: Fifo::new(),
            is_readable: Semaphore::new(0),
            is_in_frame: MaskedCell::new(false),
            is_stream: MaskedCell::new(false),
            lost: MaskedCell::new(0),
            unsent: MaskedCell::new(&[]),
            is_sent: Semaphore::new(0),
        }
    }

    /// A byte has come.
    #[inline(always)]
    pub(crate) fn put(&self, interrupt: &mut Interrupt, byte: u8) {
        interrupt.mask(|masked| self.is_in_frame.set(masked, byte != 0));
        let space = self.received.put(interrupt, byte);
        if byte == 0 || space == Some(0) || interrupt.mask(|masked| self.is_stream.get(masked)) {
            self.is_readable.post(interrupt);
        }
    }

    /// A byte is lost.
    #[inline(always)]
    pub(crate) fn lose(&self, interrupt: &mut Interrupt) {
        interrupt.mask(|masked| self.lost.count(masked));
    }

    /// The next byte to send.
    #[inline(always)]
    pub(crate) fn next(&self, masked: &Masked) -> Option<u8> {
        let (byte, rest) = self.unsent.get(masked).split_first()?;
        self.unsent.set(masked, rest);
        Some(*byte)
    }

    #[inline(always)]
    pub(crate) fn is_all_sent(&self, masked: &Masked) -> bool {
        self.unsent.get(masked).is_empty()
    }

    /// The last stop bit is on the wire.
    #[inline(always)]
    pub(crate) fn finish(&self, interrupt: &mut Interrupt) {
        self.is_sent.post(interrupt);
    }
}

/// The sending half of a line.
pub struct Transmitter<L> {
    line: PhantomData<L>,
}

/// The receiving half of a line.
pub struct Receiver<L> {
    line: PhantomData<L>,
}

impl<L: Line> Transmitter<L> {
    pub(crate) const fn new() -> Self {
        Transmitter { line: PhantomData }
    }
}

impl<L: Line> Receiver<L> {
    pub(crate) const fn new() -> Self {
        Receiver { line: PhantomData }
    }
}

impl<L: Line> Transmit for Transmitter<L> {
    fn is_busy(&self, task: &mut Task) -> bool {
        task.mask(|masked| L::port().is_in_frame.get(masked))
    }

    fn transmit(&mut self, task: &mut Task, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        // SAFETY: the interrupt posts `is_sent` only when it has read all of `bytes`, and this call, which
        // borrows them, does not return before.
        let bytes = unsafe { slice::from_raw_parts(ptr::from_ref(bytes).cast(), bytes.len()) };
        task.mask(|masked| {
            L::port().is_in_frame.set(masked, false); // what comes in is drowned
            L::port().unsent.set(masked, bytes);
        });
        L::begin(task);
        L::port().is_sent.wait(task);
    }
}

impl<L: Line> Receive for Receiver<L> {
    fn receive(&mut self, task: &mut Task, buffer: &mut [u8]) -> usize {
        let port = L::port();
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
        let port = L::port();
        let lost = task.mask(|masked| port.lost.get(masked));
        lost.saturating_add(port.received.overruns(task))
    }
}

impl<L: Line> Receiver<L> {
    /// Blocks until a byte has come, and copies what has come to the start of `buffer`. Returns how many
    /// bytes; 0 only if `buffer` is empty.
    fn read(&mut self, task: &mut Task, buffer: &mut [u8]) -> usize {
        if buffer.is_empty() {
            return 0;
        }
        let port = L::port();
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
