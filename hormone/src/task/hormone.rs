//! HORMONE: acts on topology, timer and hormones, and propagates hormones.

use kernel::{Mutex, Never, Task, now};
use tasks::api::Api;
use tasks::dock::Dock;
use tasks::mailbox::Mailbox;
use tasks::message::{Address, Message, TaskCode};
use tasks::request::Report;

use super::joints::Joints;
use crate::controller::{Controller, NOTHING, Outgoing, Response};
use crate::event::Event;
use crate::gait::GaitName;
use crate::hormone::Hormone;
use crate::status::Status;
use crate::topology;

/// Runs HORMONE on `mailbox`, walking by `gait` until told otherwise; see [`Controller::new`] for `seed`. `status` shows its
/// view of the module to whoever reads RAM.
pub fn run(
    task: &mut Task,
    mailbox: &'static Mailbox,
    gait: GaitName,
    seed: u16,
    status: &'static Mutex<Status>,
    api: Api,
) -> Never {
    let mut controller = Controller::new(gait.gait(), seed, now(task));
    let mut joints = Joints::new();
    loop {
        while let Some(message) = mailbox.take(task) {
            let response = match message.from().dock() {
                Some(dock) => receive(task, &mut controller, dock, message.payload()),
                None if message.from().task() == TaskCode::AC_RECEIVE => {
                    learn(task, &mut controller, message.payload())
                }
                None => hear(task, &mut controller, message.payload()),
            };
            // Its buffer is needed for what goes out.
            drop(message);
            match response {
                Some(response) => follow(task, &mut controller, response, api),
                None => controller.malformed(),
            }
        }
        while let Some(response) = controller.timer(now(task)) {
            follow(task, &mut controller, response, api);
        }
        status.with(task, |status| *status = *controller.status());
        let time = now(task);
        if let Some(posture) = controller.posture(time) {
            joints.turn(task, api, posture);
        }
        let due = [controller.next_due(time), controller.until_posture(time)];
        if let Some(wait) = due.into_iter().flatten().min() {
            mailbox.wake_in(task, wait);
        }
        mailbox.wait(task);
    }
}

/// A neighbour sent a hormone. `None` if it is none.
fn receive(task: &mut Task, controller: &mut Controller, dock: Dock, payload: &[u8]) -> Option<Response> {
    let hormone = Hormone::from_payload(payload)?;
    Some(controller.received(dock, hormone, now(task)))
}

/// AC_RECV reported the neighbours. `None` if these can't be.
fn learn(task: &mut Task, controller: &mut Controller, payload: &[u8]) -> Option<Response> {
    let neighbours = topology::from_bytes(payload)?;
    Some(controller.topology(&neighbours, now(task)))
}

/// A task of this module orders the robot about, or a device reports. `None` if it is neither.
fn hear(task: &mut Task, controller: &mut Controller, payload: &[u8]) -> Option<Response> {
    // No rule asks for reports yet.
    if Report::from_payload(payload).is_some() {
        return Some(NOTHING);
    }
    match Hormone::from_payload(payload)? {
        Hormone::Order(order) => Some(controller.order(None, order, now(task))),
        _ => None,
    }
}

/// Sends what is to be sent, and tells what happened.
fn follow(task: &mut Task, controller: &mut Controller, response: Response, api: Api) {
    if let Some(event) = response.event {
        api.trace(event.to_byte());
    }
    if let Some(Outgoing { hormone, docks }) = response.send {
        for dock in docks.iter() {
            let to = Address::beyond(dock, TaskCode::HORMONE);
            let from = Address::here(TaskCode::HORMONE);
            let Ok(message) = Message::new(to, from, hormone.to_payload().bytes()) else { continue };
            match api.send(task, message) {
                Ok(()) => {
                    controller.sent();
                    if let Hormone::Pace(pace) = hormone {
                        api.trace(Event::HormoneSent(dock, pace.data).to_byte());
                    }
                }
                Err(_) => controller.unsent(),
            }
        }
    }
    if let Some(action) = response.action {
        api.trace(Event::ActionBegun(action).to_byte());
    }
}
