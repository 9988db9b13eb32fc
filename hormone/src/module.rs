//! A behaviour's only access to its module (paper, section 6): it sends messages, and says what it did.

use tasks::message::{Address, Message, TaskCode};
use tasks::post_office::Undelivered;
use tasks::request::Request;

use crate::event::Event;

/// A module as its behaviours see it.
pub trait Module {
    /// Sends a message to a task of this module, or to one of a neighbour.
    ///
    /// # Errors
    /// [`Undelivered`]: there is no such task or dock, or no room now.
    fn send(&mut self, message: Message) -> Result<(), Undelivered>;

    /// Tells a debugger or simulator what has happened.
    fn trace(&mut self, event: Event);

    /// Asks a device of this module for something on behalf of HORMONE, which gets the answer.
    ///
    /// # Errors
    /// Those of [`send`](Self::send).
    fn request(&mut self, request: Request) -> Result<(), Undelivered> {
        let (to, from) = (Address::here(request.task()), Address::here(TaskCode::HORMONE));
        match Message::new(to, from, &request.to_payload()) {
            Ok(message) => self.send(message),
            Err(_) => Err(Undelivered::Ignored), // never: a request fits
        }
    }
}
