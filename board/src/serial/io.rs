//! embedded-io for the two halves of a serial line.

use core::convert::Infallible;

use embedded_io::{ErrorType, Read, Write};
use kernel::Task;
use tasks::device::Transmit;

use super::{Line, Receiver, Transmitter};
use crate::WithTask;

impl<L: Line> Transmitter<L> {
    /// This transmitter as an [`embedded_io::Write`].
    ///
    /// ```ignore
    /// transmitter.with(task).write_all(b"ready\n")
    /// ```
    pub fn with<'a>(&'a mut self, task: &'a mut Task) -> WithTask<'a, Self> {
        WithTask::new(self, task)
    }
}

impl<L: Line> Receiver<L> {
    /// This receiver as an [`embedded_io::Read`]: a stream of bytes, zeros among them.
    pub fn with<'a>(&'a mut self, task: &'a mut Task) -> WithTask<'a, Self> {
        WithTask::new(self, task)
    }
}

impl<L: Line> ErrorType for WithTask<'_, Transmitter<L>> {
    /// Sending can't fail.
    type Error = Infallible;
}

impl<L: Line> ErrorType for WithTask<'_, Receiver<L>> {
    /// Bytes that are lost are counted, as [`overruns`](tasks::device::Receive::overruns) tells.
    type Error = Infallible;
}

impl<L: Line> Write for WithTask<'_, Transmitter<L>> {
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

impl<L: Line> Read for WithTask<'_, Receiver<L>> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        Ok(self.device.read(self.task, buffer))
    }
}
