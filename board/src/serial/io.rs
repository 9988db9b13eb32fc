//! embedded-io for the two halves of a serial line.

use core::convert::Infallible;

use embedded_io::{ErrorType, Read, Write};
use kernel::Task;
use tasks::device::Transmit;

use super::{Receiver, Transmitter};
use crate::WithTask;

impl Transmitter {
    /// This transmitter as an [`embedded_io::Write`].
    ///
    /// ```ignore
    /// transmitter.with(task).write_all(b"ready\n")
    /// ```
    pub fn with<'a>(&'a mut self, task: &'a mut Task) -> WithTask<'a, Self> {
        WithTask::new(self, task)
    }
}

impl Receiver {
    /// This receiver as an [`embedded_io::Read`]: a stream of bytes, including zeros.
    pub fn with<'a>(&'a mut self, task: &'a mut Task) -> WithTask<'a, Self> {
        WithTask::new(self, task)
    }
}

impl ErrorType for WithTask<'_, Transmitter> {
    /// Sending can't fail.
    type Error = Infallible;
}

impl ErrorType for WithTask<'_, Receiver> {
    /// Lost bytes are counted: see [`overruns`](tasks::device::Receive::overruns).
    type Error = Infallible;
}

impl Write for WithTask<'_, Transmitter> {
    /// Blocks until all of `bytes` are on the wire.
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.device.transmit(self.task, bytes);
        Ok(bytes.len())
    }

    /// Nothing is ever left to flush.
    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl Read for WithTask<'_, Receiver> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        Ok(self.device.read(self.task, buffer))
    }
}
