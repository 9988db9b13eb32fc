//! A behaviour task's only access to its module (paper, section 6): it sends messages, and says what it did.

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
    /// Messages go through `office`. `trace` gets one byte for each event that a behaviour traces.
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

    /// Asks a device of this module for something on behalf of the task `from`, which gets the answer.
    ///
    /// # Errors
    /// Those of [`send`](Self::send).
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

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::mailbox::Mailbox;
    use crate::router::{Mcu, Router};
    use crate::sensor::Sensor;
    use crate::superbot::RESIDENCE;
    use kernel::{Priority, Stack, host};
    use std::sync::Mutex;
    use std::vec::Vec;

    #[test]
    fn messages_requests_and_events_get_out() {
        static HORMONE: Mailbox = Mailbox::new(2);
        static DEVICES: Mailbox = Mailbox::new(2);
        static BRIDGE: Mailbox = Mailbox::new(0);
        static OFFICE: PostOffice = PostOffice {
            router: Router::new(Mcu::Master, RESIDENCE),
            tasks: &[(TaskCode::HORMONE, &HORMONE)],
            devices: &DEVICES,
            links: &[],
            bridge: &BRIDGE,
        };
        static STACK: Stack<2000> = Stack::new();
        static EVENTS: Mutex<Vec<u8>> = Mutex::new(Vec::new());
        host::run_for(
            1,
            |boot| {
                let body = |task: &mut Task| {
                    let api = Api::new(&OFFICE, |event| EVENTS.lock().expect("no test panicked").push(event));
                    let (to, from) = (Address::here(TaskCode::HORMONE), Address::here(TaskCode::CONSOLE));
                    let message = Message::new(to, from, &[7]).expect("it is short");
                    assert_eq!(api.send(task, message), Ok(()));
                    let taken = HORMONE.take(task).expect("it has come");
                    assert_eq!(taken.message(), message);

                    let read = Request::Read(Sensor::AccelerationZ);
                    assert_eq!(api.request(task, TaskCode::CONSOLE, read), Ok(()));
                    let taken = DEVICES.take(task).expect("it has come");
                    assert_eq!((taken.from(), Request::from_payload(taken.payload())), (from, Some(read)));
                    assert_eq!(taken.to(), Address::here(TaskCode::ACCELEROMETER));
                    // The bridge's mailbox has no room.
                    let read = Request::Read(Sensor::BatteryVoltage);
                    assert_eq!(api.request(task, TaskCode::CONSOLE, read), Err(Undelivered::NoRoom));
                    api.trace(0x42);
                    drop(taken);
                    loop {
                        task.delay(kernel::LONGEST);
                    }
                };
                STACK.start(boot, Priority::P4, body).expect("the stack is free");
            },
            |_, _| {},
        );
        assert_eq!(*EVENTS.lock().expect("no test panicked"), [0x42]);
    }
}
