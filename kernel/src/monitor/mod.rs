//! A monitor: looks at memory and tasks, and steers these, by commands over a serial line. `docs/monitor.md`
//! has the commands.
//!
//! [`obey`] is the whole interpreter: it knows a [`Machine`], no device. [`run`] is the task around it.

mod interpreter;
mod session;
mod words;

use crate::context::Task;
use crate::control::{Refused, TaskHandle};

pub use interpreter::{obey, refuse_line};
pub use session::run;

/// The tasks that the monitor knows, by the names that it is to call them.
pub type Tasks = &'static [(&'static str, TaskHandle)];

/// Bytes of the longest line that is obeyed, its end not counted.
pub const LINE: usize = 48;

/// A serial line.
pub trait Line {
    /// Blocks until a byte has come.
    fn read(&mut self, task: &mut Task) -> u8;

    /// Sends `bytes`.
    fn write(&mut self, task: &mut Task, bytes: &[u8]);
}

/// What the commands act on.
pub trait Machine {
    /// A byte of the reply.
    fn put(&mut self, byte: u8);

    /// Reads the data space: registers, I/O, SRAM. To read an I/O register may change it.
    fn read(&mut self, address: u16) -> u8;

    /// Writes the data space.
    fn write(&mut self, address: u16, byte: u8);

    /// The tasks that have names.
    fn tasks(&self) -> Tasks;

    /// The task that the monitor itself is.
    fn monitor(&mut self) -> &mut Task;

    /// A task's stack pointer as the kernel has saved it: bit 15 says that an interrupt saved all registers.
    fn stack_pointer(&mut self, task: TaskHandle) -> u16;

    /// Where the task's stack begins, its lowest byte.
    fn stack_bottom(&self, task: TaskHandle) -> u16;

    /// Runs one instruction of the task: [`TaskHandle::step`].
    ///
    /// # Errors
    /// As there.
    fn step(&mut self, task: TaskHandle) -> Result<(), Refused>;
}
