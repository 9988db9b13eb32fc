//! How devices report.

use kernel::Task;

use crate::message::{Address, Message, TaskCode};
use crate::post_office::PostOffice;
use crate::request::{Payload, Report, Request};
use crate::router::Source;

/// Where reports go out, and what went wrong on the way is counted.
pub struct Desk {
    office: &'static PostOffice,
    /// Reports and requests to other devices that found no room. Wraps.
    pub unsent: u16,
    /// Messages that were no request to a device of this MCU. Wraps.
    pub malformed: u16,
}

impl Desk {
    /// A desk whose mail goes through `office`.
    pub const fn new(office: &'static PostOffice) -> Self {
        Desk { office, unsent: 0, malformed: 0 }
    }

    /// Reports to `client`, on behalf of the device's task `from`.
    pub fn report(&mut self, task: &mut Task, from: TaskCode, client: TaskCode, report: Report) {
        self.send(task, from, client, report.to_payload());
    }

    /// Passes a request on to another device.
    pub fn request(&mut self, task: &mut Task, from: TaskCode, request: Request) {
        self.send(task, from, request.task(), request.to_payload());
    }

    #[inline(never)]
    fn send(&mut self, task: &mut Task, from: TaskCode, to: TaskCode, payload: Payload) {
        let message = Message::new(Address::here(to), Address::here(from), &payload);
        let is_sent = message.is_ok_and(|message| self.office.deliver(task, message, Source::Task).is_ok());
        if !is_sent {
            self.unsent = self.unsent.wrapping_add(1);
        }
    }
}
