//! Serial lines: what the tasks of a USART, or of the UART in software, share with its interrupts.
//!
//! A line carries frames that end in a zero byte. A byte that comes in wakes the task only at a frame's end or
//! when the FIFO is half full. To send, the task hands over the whole slice, and sleeps until the last stop bit is on
//! the wire.
//!
//! What light carries is half duplex: two ends that send at once drown each other, and an end may hear its own
//! reflection.

mod io;

use core::{ptr, slice};

use kernel::{Context, Fifo, Interrupt, Masked, MaskedCell, Semaphore, Task, Ticks, now};
use tasks::device::{Receive, Transmit};

/// Bytes that wait for the task.
const CAPACITY: usize = 32;

/// When so many have come the task takes them, so that there is less to do at the end of a long frame.
const HALF: u8 = CAPACITY as u8 / 2;

/// Within a frame bytes follow each other without a pause. After more ticks than this the rest of it is not coming.
const PAUSE: Ticks = 1;

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
    received: Fifo<CAPACITY>,
    is_readable: Semaphore,
    /// What is posted instead of `is_readable`.
    listener: MaskedCell<Option<&'static Semaphore>>,
    /// Whether the byte that came last was within a frame, and when it came.
    is_in_frame: MaskedCell<bool>,
    heard_at: MaskedCell<Ticks>,
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
            listener: MaskedCell::new(None),
            is_in_frame: MaskedCell::new(false),
            heard_at: MaskedCell::new(0),
            is_stream: MaskedCell::new(false),
            lost: MaskedCell::new(0),
            unsent: MaskedCell::new(&[]),
            is_sent: Semaphore::new(0),
        }
    }

    /// A byte has come.
    #[inline(always)]
    pub(crate) fn put(&self, interrupt: &mut Interrupt, byte: u8) {
        let time = now(interrupt);
        let was_cut_off = interrupt.mask(|masked| {
            let is_late = time.wrapping_sub(self.heard_at.get(masked)) > PAUSE;
            let was_in_frame = self.is_in_frame.get(masked);
            self.heard_at.set(masked, time);
            self.is_in_frame.set(masked, byte != 0);
            was_in_frame && is_late
        });
        if was_cut_off {
            // Its end was lost. The frame that begins now shall not be taken for the rest of it.
            self.received.put(interrupt, 0);
        }
        let space = self.received.put(interrupt, byte);
        if byte == 0
            || was_cut_off
            || matches!(space, Some(0 | HALF))
            || interrupt.mask(|masked| self.is_stream.get(masked))
        {
            interrupt.mask(|masked| self.listener.get(masked)).unwrap_or(&self.is_readable).post(interrupt);
        }
    }

    /// A byte is lost.
    #[inline(always)]
    pub(crate) fn lose(&self, interrupt: &mut Interrupt) {
        interrupt.mask(|masked| self.lost.count(masked));
    }

    /// The next byte to send, and whether it is the last.
    #[inline(always)]
    pub(crate) fn next(&self, masked: &Masked) -> Option<(u8, bool)> {
        let (byte, rest) = self.unsent.get(masked).split_first()?;
        self.unsent.set(masked, rest);
        Some((*byte, rest.is_empty()))
    }

    /// The last stop bit is on the wire.
    #[inline(always)]
    pub(crate) fn finish(&self, interrupt: &mut Interrupt) {
        self.is_sent.post(interrupt);
    }
}

/// The sending half of a line. Of one type for all lines: the tasks that have it are in flash once.
pub struct Transmitter {
    port: &'static Port,
    begin: fn(&mut Task),
}

/// The receiving half of a line. Of one type for all lines, too.
pub struct Receiver {
    port: &'static Port,
    /// Bytes of the frame that is coming in, up to 255.
    length: u8,
}

impl Transmitter {
    pub(crate) fn of<L: Line>() -> Self {
        Transmitter { port: L::port(), begin: L::begin }
    }
}

impl Receiver {
    pub(crate) fn of<L: Line>() -> Self {
        Receiver { port: L::port(), length: 0 }
    }
}

impl Transmit for Transmitter {
    fn is_busy(&self, task: &mut Task) -> bool {
        let time = now(task);
        task.mask(|masked| {
            let is_late = time.wrapping_sub(self.port.heard_at.get(masked)) > PAUSE;
            self.port.is_in_frame.get(masked) && !is_late
        })
    }

    fn transmit(&mut self, task: &mut Task, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        // SAFETY: the interrupt posts `is_sent` only when it has read all of `bytes`, and this call, which
        // borrows them, does not return before.
        let bytes = unsafe { slice::from_raw_parts(ptr::from_ref(bytes).cast(), bytes.len()) };
        task.mask(|masked| {
            self.port.is_in_frame.set(masked, false); // what comes in is drowned
            self.port.unsent.set(masked, bytes);
        });
        (self.begin)(task);
        self.port.is_sent.wait(task);
    }
}

impl Receive for Receiver {
    fn listen(&mut self, task: &mut Task, signal: &'static Semaphore) {
        task.mask(|masked| self.port.listener.set(masked, Some(signal)));
    }

    fn receive(&mut self, task: &mut Task, buffer: &mut [u8]) -> Option<usize> {
        let mut length = self.length;
        while let Some(byte) = self.port.received.take(task) {
            if let Some(slot) = buffer.get_mut(usize::from(length)) {
                *slot = byte;
            }
            length = length.saturating_add(1);
            if byte == 0 {
                self.length = 0;
                if usize::from(length) <= buffer.len() {
                    return Some(length.into());
                }
                task.mask(|masked| self.port.lost.count(masked));
                length = 0;
            }
        }
        self.length = length;
        None
    }

    fn overruns(&self, task: &mut Task) -> u16 {
        let port = self.port;
        let lost = task.mask(|masked| port.lost.get(masked));
        lost.saturating_add(port.received.overruns(task))
    }
}

impl Receiver {
    /// Blocks until a frame has come; see [`Receive::receive`]. Returns its length.
    pub fn wait(&mut self, task: &mut Task, buffer: &mut [u8]) -> usize {
        loop {
            match self.receive(task, buffer) {
                Some(length) => return length,
                None => self.port.is_readable.wait(task),
            }
        }
    }

    /// Blocks until a byte has come, and copies what has come to the start of `buffer`. Returns how many
    /// bytes; 0 only if `buffer` is empty.
    fn read(&mut self, task: &mut Task, buffer: &mut [u8]) -> usize {
        if buffer.is_empty() {
            return 0;
        }
        let port = self.port;
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
