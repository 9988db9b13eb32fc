//! Serial lines: what the tasks of a USART, or of the UART in software, share with its interrupts.
//!
//! A line carries frames that end in a zero byte. A received byte wakes the task only at a frame's end, or
//! when the [inbox](inbox::Inbox) is half full. To send, the task hands over the whole slice, and sleeps
//! until the last stop bit is on the wire.
//!
//! A line of light is half duplex: two ends that send at the same time drown each other, and an end may
//! receive its own reflection.

mod inbox;
mod io;
mod outbox;

use kernel::{Context, Interrupt, Masked, MaskedCell, Semaphore, Task, now};
use tasks::device::{Receive, Transmit};

use crate::deferred::Serving;
use crate::guarded::Guarded;
use crate::tick;
use inbox::{Content, Inbox};
use outbox::Outbox;

/// A line, named by its type.
pub trait Line {
    /// What its tasks and interrupts share.
    #[doc(hidden)]
    fn port() -> &'static Port;

    /// Begins to send what the port has to send, at least one byte. Returns whether it did: a line that
    /// detects the beginning of a character before its end does not begin while one comes in.
    #[doc(hidden)]
    fn begin(task: &mut Task) -> bool;
}

/// What the tasks and the interrupts of a line share.
#[doc(hidden)]
#[repr(C)] // otherwise the fields would be in another order
pub struct Port {
    /// First: a task that waits needs its address and the port's, which are the same then.
    is_sent: Semaphore,
    inbox: Inbox,
    is_readable: Semaphore,
    /// The semaphore to post instead of `is_readable`.
    listener: MaskedCell<Option<&'static Semaphore>>,
    outbox: Guarded<Outbox>,
}

impl Port {
    pub(crate) const fn new() -> Self {
        Port {
            is_sent: Semaphore::new(0),
            inbox: Inbox::new(),
            is_readable: Semaphore::new(0),
            listener: MaskedCell::new(None),
            outbox: Guarded::new(Outbox::new()),
        }
    }

    /// Stores a received byte. Returns whether the task is to be [woken](Self::wake).
    #[inline(always)]
    pub(crate) fn put(&self, masked: &Masked, byte: u8) -> bool {
        self.inbox.store(masked, tick::present(masked), byte)
    }

    /// Wakes the task for what is in the inbox.
    #[inline(always)]
    pub fn wake(&self, serving: &mut Serving) {
        let listener = serving.interrupt.mask(|masked| self.listener.get(masked));
        serving.window();
        listener.unwrap_or(&self.is_readable).post(serving.interrupt);
    }

    /// Counts a lost byte.
    #[inline(always)]
    pub(crate) fn lose(&self, masked: &Masked) {
        self.inbox.lose(masked);
    }

    /// The next byte to send, and whether it is the last.
    #[inline(always)]
    pub(crate) fn next(&self, masked: &Masked) -> Option<(u8, bool)> {
        self.outbox.get(masked).take()
    }

    /// Called when the last stop bit is on the wire.
    #[inline(always)]
    pub fn finish(&self, interrupt: &mut Interrupt) {
        self.is_sent.post(interrupt);
    }
}

/// Whether what a [`Beginner`] has begun to send on this line has been sent. Returns `true` once.
#[inline(always)]
pub fn has_sent<L: Line>(context: &mut impl Context) -> bool {
    L::port().is_sent.try_wait(context)
}

/// The sending half of a line. All lines have this one type, so that the code of their tasks is in flash
/// once.
pub struct Transmitter {
    port: &'static Port,
    begin: fn(&mut Task) -> bool,
}

/// The sending half of a line for a task that does not block. A [`Transmitter`] becomes one for good: so none
/// finds a frame under way that it has not sent, or the signal of one.
pub struct Beginner(Transmitter);

/// Stands for the length of a frame that does not fit its buffer, or has more than 254 bytes.
const TOO_LONG: u8 = u8::MAX;

/// The receiving half of a line. All lines have this one type, too.
pub struct Receiver {
    port: &'static Port,
    /// The bytes received of the present frame, or [`TOO_LONG`].
    length: u8,
}

impl Transmitter {
    pub(crate) fn of<L: Line>() -> Self {
        Transmitter { port: L::port(), begin: L::begin }
    }

    /// This half for a task that does not block.
    pub fn into_beginner(self) -> Beginner {
        Beginner(self)
    }

    /// Begins to send `bytes`, at least one. Returns whether it did.
    ///
    /// # Safety
    /// `bytes` must stay as they are until the outbox is empty, or until another call begins.
    #[inline(always)]
    unsafe fn begin(&mut self, task: &mut Task, bytes: &[u8]) -> bool {
        // SAFETY: the caller guarantees that the bytes are there until the interrupt has read all of them.
        task.mask(|masked| unsafe { self.port.outbox.get(masked).fill(bytes) });
        (self.begin)(task)
    }
}

impl Beginner {
    /// Begins to send `bytes`, at least one. Returns whether it did: it does not while a character is coming
    /// in. Afterwards [`has_sent`] returns `true` once, when the last stop bit is on the wire.
    ///
    /// # Safety
    /// [`has_sent`] must have returned `true` for everything that was begun before. `bytes` must stay as they
    /// are until it does for them, too, or, if this call did not begin, until the next call.
    #[inline(always)]
    pub unsafe fn begin(&mut self, task: &mut Task, bytes: &[u8]) -> bool {
        // SAFETY: `has_sent` returns `true` for them when the interrupt has read all of them, and the caller
        // guarantees that no earlier transmission is left for which it would.
        unsafe { self.0.begin(task, bytes) }
    }

    /// Whether a byte that is received now may belong to a frame that has begun: see [`Transmit::is_busy`].
    #[inline(always)]
    pub fn is_busy(&self, task: &mut Task) -> bool {
        self.0.is_busy(task)
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
        task.mask(|masked| self.port.inbox.is_in_frame(masked, time))
    }

    fn transmit(&mut self, task: &mut Task, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        // SAFETY: this call, which borrows `bytes`, does not return before the interrupt has taken all of
        // them.
        while !unsafe { self.begin(task, bytes) } {
            task.delay(1);
        }
        // The signal means that the last stop bit is on the wire. The outbox tells whether all bytes are
        // taken: so no signal, whoever has posted it, releases what the interrupt still reads.
        loop {
            self.port.is_sent.wait(task);
            if task.mask(|masked| self.port.outbox.get(masked).is_empty()) {
                break;
            }
        }
    }
}

impl Receive for Receiver {
    fn listen(&mut self, task: &mut Task, signal: &'static Semaphore) {
        task.mask(|masked| self.port.listener.set(masked, Some(signal)));
    }

    fn receive(&mut self, task: &mut Task, buffer: &mut [u8]) -> Option<usize> {
        loop {
            let mut length = self.length;
            let is_whole = self.port.inbox.drain(task, Content::Frames, |byte| {
                length = match buffer.get_mut(usize::from(length)) {
                    Some(slot) if length < TOO_LONG => {
                        *slot = byte;
                        length + 1
                    }
                    _ => TOO_LONG,
                };
                byte == 0
            });
            if !is_whole {
                self.length = length;
                return None;
            }
            self.length = 0;
            if length != TOO_LONG {
                return Some(length.into());
            }
            task.mask(|masked| self.port.inbox.lose(masked));
        }
    }

    fn overruns(&self, task: &mut Task) -> u16 {
        task.mask(|masked| self.port.inbox.lost(masked))
    }
}

impl Receiver {
    /// Blocks until a frame has been received; see [`Receive::receive`]. Returns its length.
    pub fn wait(&mut self, task: &mut Task, buffer: &mut [u8]) -> usize {
        loop {
            match self.receive(task, buffer) {
                Some(length) => return length,
                None => self.port.is_readable.wait(task),
            }
        }
    }

    /// Blocks until a byte has been received, and copies what has been received to the start of `buffer`.
    /// Returns the number of bytes; 0 only if `buffer` is empty.
    fn read(&mut self, task: &mut Task, buffer: &mut [u8]) -> usize {
        if buffer.is_empty() {
            return 0;
        }
        let port = self.port;
        task.mask(|masked| port.inbox.wake_at_first(masked, true));
        let length = loop {
            let mut length = 0;
            port.inbox.drain(task, Content::Stream, |byte| {
                if let Some(slot) = buffer.get_mut(length) {
                    *slot = byte;
                    length += 1;
                }
                length >= buffer.len()
            });
            if length > 0 {
                break length;
            }
            port.is_readable.wait(task);
        };
        task.mask(|masked| port.inbox.wake_at_first(masked, false));
        length
    }
}
