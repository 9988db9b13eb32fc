//! HORMONE: acts on topology, timer and hormones, and propagates hormones.

use kernel::{Mutex, Never, Task, now};
use tasks::api::Api;
use tasks::dock::Dock;
use tasks::mailbox::Mailbox;
use tasks::message::{Address, Message, TaskCode};

use crate::controller::{Controller, Response};
use crate::event::Event;
use crate::hormone::Hormone;
use crate::rule::Outgoing;
use crate::status::Status;
use crate::topology;

/// Runs HORMONE on `mailbox`. `status` shows its view of the module to whoever reads RAM.
pub fn run<const N: usize>(
    task: &mut Task,
    mailbox: &'static Mailbox,
    mut controller: Controller<N>,
    status: &'static Mutex<Status>,
    api: Api,
) -> Never {
    loop {
        while let Some(message) = mailbox.take(task) {
            let response = match message.from().dock() {
                Some(dock) => receive(&mut controller, dock, message.payload(), api),
                None => learn(task, &mut controller, message.payload(), api),
            };
            // Its buffer is needed for what goes out.
            drop(message);
            follow(task, &mut controller, response, api);
        }
        let time = now(task);
        if let Some(response) = controller.timer(time) {
            if let Some(Outgoing { hormone, .. }) = response.send {
                api.trace(Event::HormoneGenerated(hormone.data).to_byte());
            }
            follow(task, &mut controller, Some(response), api);
        }
        let view = *controller.status();
        status.with(task, |status| *status = view);
        if let Some(wait) = controller.next_due(now(task)) {
            mailbox.wake_in(task, wait);
        }
        mailbox.wait(task);
    }
}

/// A neighbour sent a hormone.
fn receive<const N: usize>(
    controller: &mut Controller<N>,
    dock: Dock,
    payload: &[u8],
    api: Api,
) -> Option<Response> {
    let Some(hormone) = Hormone::from_payload(payload) else {
        controller.malformed();
        return None;
    };
    api.trace(Event::HormoneReceived(dock, hormone.data).to_byte());
    Some(controller.received(dock, hormone))
}

/// AC_RECV reported the neighbours.
fn learn<const N: usize>(
    task: &mut Task,
    controller: &mut Controller<N>,
    payload: &[u8],
    api: Api,
) -> Option<Response> {
    let Some(neighbours) = topology::from_bytes(payload) else {
        controller.malformed();
        return None;
    };
    let response = controller.topology(&neighbours, now(task));
    api.trace(Event::TopologyChanged(controller.status().module_type).to_byte());
    Some(response)
}

/// Sends what is to be sent. The action is in the status, and goes to the motors' tasks once there are any.
fn follow<const N: usize>(
    task: &mut Task,
    controller: &mut Controller<N>,
    response: Option<Response>,
    api: Api,
) {
    let Some(Outgoing { hormone, docks }) = response.and_then(|response| response.send) else { return };
    for dock in docks.iter() {
        let to = Address::beyond(dock, TaskCode::HORMONE);
        let from = Address::here(TaskCode::HORMONE);
        let Ok(message) = Message::new(to, from, &hormone.to_payload()) else { continue };
        match api.send(task, message) {
            Ok(()) => {
                controller.sent();
                api.trace(Event::HormoneSent(dock, hormone.data).to_byte());
            }
            Err(_) => controller.unsent(),
        }
    }
}
