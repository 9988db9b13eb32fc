//! The methods of embedded-hal and embedded-io have no place for the calling task, so an adaptor carries it.

use kernel::Task;

/// A device, and the task that uses it.
pub struct WithTask<'a, Device> {
    pub(crate) device: &'a mut Device,
    pub(crate) task: &'a mut Task,
}

impl<'a, Device> WithTask<'a, Device> {
    pub(crate) fn new(device: &'a mut Device, task: &'a mut Task) -> Self {
        WithTask { device, task }
    }
}
