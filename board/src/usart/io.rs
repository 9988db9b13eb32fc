//! embedded-io for the two halves of a USART. Its methods have no place for the calling task, so an
//! adaptor carries it.

use core::convert::Infallible;

use embedded_io::{ErrorType, Read, Write};
use kernel::Task;
use tasks::device::Transmit;

use super::{Receiver, Transmitter, Usart};

/// Half of a USART, and the task that uses it.
///
/// ```ignore
/// transmitter.with(task).write_all(b"ready\n")
/// ```
pub struct WithTask<'a, Half> {
    half: &'a mut Half,
    task: &'a mut Task,
}

impl<U: Usart> Transmitter<U> {
    /// This transmitter as an [`embedded_io::Write`].
    pub fn with<'a>(&'a mut self, task: &'a mut Task) -> WithTask<'a, Self> {
        WithTask { half: self, task }
    }
}

impl<U: Usart> Receiver<U> {
    /// This receiver as an [`embedded_io::Read`]: a stream of bytes, zeros among them.
    pub fn with<'a>(&'a mut self, task: &'a mut Task) -> WithTask<'a, Self> {
        WithTask { half: self, task }
    }
}

impl<Half> ErrorType for WithTask<'_, Half> {
    /// Sending can't fail; bytes that are lost on the way in are counted, as
    /// [`overruns`](tasks::device::Receive::overruns) tells.
    type Error = Infallible;
}

impl<U: Usart> Write for WithTask<'_, Transmitter<U>> {
    /// Blocks until all of `bytes` are on the wire.
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.half.transmit(self.task, bytes);
        Ok(bytes.len())
    }

    /// Nothing is ever left to flush.
    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl<U: Usart> Read for WithTask<'_, Receiver<U>> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        Ok(self.half.read(self.task, buffer))
    }
}
