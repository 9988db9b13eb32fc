//! All that a behaviour task sees of its module (paper, section 6): it sends messages, and says what it did.

use kernel::Task;

use crate::message::{Address, Message, TaskCode};
use crate::post_office::{PostOffice, Undelivered};
use crate::request::Request;
use crate::router::Source;

/// A behaviour's way to the rest of the module, and beyond.
#[derive(Clone, Copy)]
pub struct Api {
    office: &'static PostOffice,
    trace: fn(u8),
}

impl Api {
    /// Messages go through `office`. `trace` gets one byte for each event that a behaviour tells of.
    pub const fn new(office: &'static PostOffice, trace: fn(u8)) -> Self {
        Api { office, trace }
    }

    /// Sends a message to a task of this module, or to one of a neighbour.
    ///
    /// # Errors
    /// [`Undelivered`]: there is no such task or dock, or no room now.
    pub fn send(&self, task: &mut Task, message: Message) -> Result<(), Undelivered> {
        self.office.deliver(task, message, Source::Task)
    }

    /// Asks a device of this module for something, on behalf of the task `from`, to which the answer goes.
    ///
    /// # Errors
    /// As of [`send`](Self::send).
    pub fn request(&self, task: &mut Task, from: TaskCode, request: Request) -> Result<(), Undelivered> {
        match Message::new(Address::here(request.task()), Address::here(from), &request.to_payload()) {
            Ok(message) => self.send(task, message),
            Err(_) => Err(Undelivered::Ignored), // never: a request fits
        }
    }

    /// Tells a debugger or simulator of an event.
    pub fn trace(&self, event: u8) {
        (self.trace)(event);
    }
}
