//! Byte FIFOs that tasks wait on.

use crate::context::{Context, Task};
use crate::fifo::Fifo;
use crate::proxy::Elapsed;
use crate::semaphore::Semaphore;
use crate::timer::Ticks;

/// A FIFO of up to `BYTES` bytes, at most 255, on which tasks wait: for a byte, or for space. 8 bytes besides
/// its own.
///
/// ```
/// use kernel::{Pipe, Task};
/// static TYPED: Pipe<16> = Pipe::new();
/// fn echo(task: &mut Task, screen: &Pipe<80>) {
///     let byte = TYPED.take(task);
///     screen.put(task, byte);
/// }
/// ```
///
/// Waiting tasks are served by priority, and in the order in which they came among equals. For an interrupt
/// that wakes its task only now and then, say at the end of a line, a [`Fifo`] is better.
pub struct Pipe<const BYTES: usize> {
    fifo: Fifo<BYTES>,
    /// A signal for each byte, or the tasks that wait for one.
    filled: Semaphore,
    /// A signal for each free place, or the tasks that wait for one.
    free: Semaphore,
}

impl<const BYTES: usize> Default for Pipe<BYTES> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const BYTES: usize> Pipe<BYTES> {
    /// An empty pipe.
    pub const fn new() -> Self {
        Pipe { fifo: Fifo::new(), filled: Semaphore::new(0), free: Semaphore::new(BYTES as u8) }
    }

    /// Appends `byte`, and blocks until there is space.
    pub fn put(&self, task: &mut Task, byte: u8) {
        self.free.wait_by_call(task);
        self.fill(task, byte);
    }

    /// Appends `byte`, and blocks until there is space, for `ticks` ticks at most; see
    /// [`Semaphore::wait_timeout`].
    ///
    /// # Errors
    /// [`Elapsed`] when the time is up. The byte is not in the pipe then.
    pub fn put_timeout(&self, task: &mut Task, byte: u8, ticks: Ticks) -> Result<(), Elapsed> {
        self.free.wait_timeout(task, ticks)?;
        self.fill(task, byte);
        Ok(())
    }

    /// Appends `byte` if there is space. Returns whether there was; if not, the byte is lost, and counted.
    pub fn try_put(&self, context: &mut impl Context, byte: u8) -> bool {
        let has_space = self.free.try_wait(context);
        if has_space {
            self.fill(context, byte);
        } else {
            context.mask(|masked| self.fifo.ring().count_overrun(masked));
        }
        has_space
    }

    /// Removes the first byte, and blocks until there is one.
    pub fn take(&self, task: &mut Task) -> u8 {
        loop {
            self.filled.wait_by_call(task);
            // The signal stood for a byte, so there is one.
            if let Some(byte) = self.drain(task) {
                return byte;
            }
        }
    }

    /// Removes the first byte, and blocks until there is one, for `ticks` ticks at most; see
    /// [`Semaphore::wait_timeout`].
    ///
    /// # Errors
    /// [`Elapsed`] when the time is up.
    pub fn take_timeout(&self, task: &mut Task, ticks: Ticks) -> Result<u8, Elapsed> {
        self.filled.wait_timeout(task, ticks)?;
        self.drain(task).ok_or(Elapsed)
    }

    /// Removes the first byte, if there is one.
    pub fn try_take(&self, context: &mut impl Context) -> Option<u8> {
        if self.filled.try_wait(context) { self.drain(context) } else { None }
    }

    /// The first byte, if there is one. It stays.
    pub fn peek(&self, context: &mut impl Context) -> Option<u8> {
        self.fifo.peek(context)
    }

    /// How many bytes there are.
    pub fn length(&self, context: &mut impl Context) -> u8 {
        self.fifo.length(context)
    }

    /// The free space, in bytes.
    pub fn space(&self, context: &mut impl Context) -> u8 {
        self.fifo.space(context)
    }

    /// Drops all bytes, including those that waiting tasks put in meanwhile. If a task of higher priority
    /// keeps putting bytes without a pause, this never ends.
    pub fn flush(&self, context: &mut impl Context) {
        while self.try_take(context).is_some() {}
    }

    /// How many bytes [`try_put`](Self::try_put) has lost because there was no space.
    pub fn overruns(&self, context: &mut impl Context) -> u16 {
        self.fifo.overruns(context)
    }

    /// Fills a place, after its signal in `free` was taken.
    fn fill(&self, context: &mut impl Context, byte: u8) {
        let is_due = context.mask(|masked| {
            self.fifo.ring().put(masked, byte);
            self.filled.word.signal_by_call(masked)
        });
        context.reschedule(is_due);
    }

    /// Removes a byte, after its signal in `filled` was taken.
    fn drain(&self, context: &mut impl Context) -> Option<u8> {
        let (byte, is_due) = context.mask(|masked| {
            let byte = self.fifo.ring().take(masked);
            (byte, self.free.word.signal_by_call(masked))
        });
        context.reschedule(is_due);
        byte
    }
}
