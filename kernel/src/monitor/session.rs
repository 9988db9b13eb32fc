//! The monitor's task.

use core::ptr;

use super::{LINE, Line, Machine, Tasks, obey, refuse_line};
use crate::arch;
use crate::context::{Context, Never, Task};
use crate::control::{Refused, TaskHandle};

/// Reads commands from `line` and replies there, forever. `step` runs one instruction of a task: see
/// [`TaskHandle::step`].
///
/// A line ends in CR or LF. After each reply comes a prompt, `> `.
///
/// # Safety
/// Commands can write any value to any address. Their author is responsible for that, as with a debug probe.
pub unsafe fn run(
    task: &mut Task,
    line: &mut impl Line,
    tasks: Tasks,
    step: &mut impl FnMut(&mut Task, TaskHandle) -> Result<(), Refused>,
) -> Never {
    let mut typed = [0; LINE];
    loop {
        let length = read_line(task, line, &mut typed);
        let mut session = Session { task, line, tasks, step, reply: [0; 16], length: 0 };
        match length.and_then(|length| typed.get(..length)) {
            Some(command) => obey(command, &mut session),
            None => refuse_line(&mut session),
        }
        session.put(b'>');
        session.put(b' ');
        session.flush();
    }
}

/// Reads up to the end of a line. Returns its length, or `None` if it does not fit.
fn read_line(task: &mut Task, line: &mut impl Line, typed: &mut [u8]) -> Option<usize> {
    let mut length = 0usize;
    loop {
        match line.read(task) {
            b'\r' | b'\n' if length == 0 => {}
            b'\r' | b'\n' => return Some(length).filter(|length| *length <= typed.len()),
            byte => {
                if let Some(slot) = typed.get_mut(length) {
                    *slot = byte;
                }
                length = length.saturating_add(1);
            }
        }
    }
}

struct Session<'a, L, S> {
    task: &'a mut Task,
    line: &'a mut L,
    tasks: Tasks,
    step: &'a mut S,
    /// The part of the reply that is not sent yet.
    reply: [u8; 16],
    length: usize,
}

impl<L: Line, S> Session<'_, L, S> {
    fn flush(&mut self) {
        if let Some(reply) = self.reply.get(..self.length) {
            self.line.write(self.task, reply);
        }
        self.length = 0;
    }
}

impl<L: Line, S: FnMut(&mut Task, TaskHandle) -> Result<(), Refused>> Machine for Session<'_, L, S> {
    fn put(&mut self, byte: u8) {
        if let Some(slot) = self.reply.get_mut(self.length) {
            *slot = byte;
            self.length = self.length.wrapping_add(1);
        }
        if self.length >= self.reply.len() {
            self.flush();
        }
    }

    fn read(&mut self, address: u16) -> u8 {
        // SAFETY: any address of the data space can be read; one that is not in use gives a meaningless
        // value.
        unsafe { ptr::with_exposed_provenance::<u8>(address.into()).read_volatile() }
    }

    fn write(&mut self, address: u16, byte: u8) {
        // SAFETY: only `run` makes a session, and its caller has accepted that commands write anywhere.
        unsafe { ptr::with_exposed_provenance_mut::<u8>(address.into()).write_volatile(byte) }
    }

    fn tasks(&self) -> Tasks {
        self.tasks
    }

    fn monitor(&mut self) -> &mut Task {
        self.task
    }

    fn stack_pointer(&mut self, task: TaskHandle) -> u16 {
        self.task.mask(|masked| task.control.stack_pointer.get(masked)) as u16
    }

    fn stack_bottom(&self, task: TaskHandle) -> u16 {
        arch::stack(task.control, task.bytes).map_or(0, |stack| stack.start as u16)
    }

    fn step(&mut self, task: TaskHandle) -> Result<(), Refused> {
        (self.step)(self.task, task)
    }
}
