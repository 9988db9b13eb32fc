//! A monitor: shows and changes memory and tasks by commands over a serial line. `docs/monitor.md` lists the
//! commands.
//!
//! [`obey`] is the whole interpreter: it knows a [`Machine`], but no device. [`run`] is the task around it.

mod interpreter;
mod session;
mod words;

use crate::context::Task;
use crate::control::{Refused, TaskHandle};

pub use interpreter::{obey, refuse_line};
pub use session::run;

/// The tasks that the monitor knows, each with the name that it uses.
pub type Tasks = &'static [(&'static str, TaskHandle)];

/// The most bytes in a command line, without the line end.
pub const LINE: usize = 48;

/// A serial line.
pub trait Line {
    /// Blocks until a byte has been received.
    fn read(&mut self, task: &mut Task) -> u8;

    /// Sends `bytes`.
    fn write(&mut self, task: &mut Task, bytes: &[u8]);
}

/// The machine that the commands act on.
pub trait Machine {
    /// Puts a byte of the reply.
    fn put(&mut self, byte: u8);

    /// Reads the data space: registers, I/O, SRAM. Reading an I/O register may change it.
    fn read(&mut self, address: u16) -> u8;

    /// Writes the data space.
    fn write(&mut self, address: u16, byte: u8);

    /// The tasks that have names.
    fn tasks(&self) -> Tasks;

    /// The monitor's own task.
    fn monitor(&mut self) -> &mut Task;

    /// A task's stack pointer as the kernel has saved it: bit 15 is set if an interrupt saved all registers.
    fn stack_pointer(&mut self, task: TaskHandle) -> u16;

    /// The address of the lowest byte of the task's stack.
    fn stack_bottom(&self, task: TaskHandle) -> u16;

    /// Runs one instruction of the task: [`TaskHandle::step`].
    ///
    /// # Errors
    /// Those of [`TaskHandle::step`].
    fn step(&mut self, task: TaskHandle) -> Result<(), Refused>;
}
