//! HORMONE: acts on topology, timer and hormones, and propagates hormones.

use kernel::{LONGEST, Mutex, Task, Ticks, now};
use tasks::api::Api;
use tasks::dock::Dock;
use tasks::message::{Address, Buffered, Message, TaskCode};
use tasks::request::{Report, Request};

use super::docks::Docks;
use super::joints::Joints;
use crate::action::Posture;
use crate::controller::{Controller, NOTHING, Outgoing, Response};
use crate::event::Event;
use crate::gait::GaitName;
use crate::hormone::Hormone;
use crate::sense::Sense;
use crate::status::Status;
use crate::time::{reached, until};
use crate::topology;

/// How soon the count of messages that could not be read is shown, in ticks of 1 ms.
const SHOWN_WITHIN: Ticks = 20;

/// The state of HORMONE, and what it told the joints and docks.
pub struct Behaviour {
    controller: Controller,
    joints: Joints,
    docks: Docks,
    /// When it has something to do.
    due: Ticks,
}

impl Behaviour {
    /// A module at power-up; see [`Controller::new`].
    #[inline(never)] // else a copy of it would stay on the stack
    pub fn new(gait: GaitName, seed: u16, now: Ticks) -> Self {
        let controller = Controller::new(gait.gait(), seed, now);
        Behaviour { controller, joints: Joints::new(), docks: Docks::new(), due: now }
    }

    /// Does what a message asks for.
    #[inline(never)]
    pub fn receive(&mut self, task: &mut Task, message: Buffered, api: Api) {
        let controller = &mut self.controller;
        let response = match message.from().dock() {
            Some(dock) => receive(task, controller, dock, message.payload()),
            None if message.from().task() == TaskCode::AC_RECEIVE => {
                learn(task, controller, message.payload())
            }
            None if message.from().task().is_behaviour() => obey(task, controller, message.payload()),
            None => {
                // Of what devices report, no more matters.
                if let Some((axis, state)) = Report::of_joint(message.payload()) {
                    self.joints.hear(axis, state);
                }
                read(controller, message.payload());
                Some(NOTHING)
            }
        };
        // Its buffer is needed for what goes out.
        drop(message);
        let Some(response) = response else { return self.malformed(task) };
        follow(task, controller, response, api);
        self.due = now(task);
    }

    /// Counts a message to a behaviour that could not be read. A flood of them shall not keep the module
    /// busy.
    pub fn malformed(&mut self, task: &mut Task) {
        self.controller.malformed();
        let time = now(task);
        if until(self.due, time) > SHOWN_WITHIN {
            self.due = time.wrapping_add(SHOWN_WITHIN);
        }
    }

    /// Does what it is time for, after a message too. Returns when there will be more to do.
    pub fn act(&mut self, task: &mut Task, status: &'static Mutex<Status>, api: Api) -> Ticks {
        if reached(self.due, now(task)) {
            self.beat(task, api);
            if self.controller.is_beat() {
                self.joints.retry();
            }
            status.with(task, |status| *status = *self.controller.status());
            if let Some(posture) = self.posture(now(task)) {
                self.joints.turn(task, api, posture);
            }
            self.docks.ask(task, api, self.controller.status().action.docking());
            self.ask_sensors(task, api);
        }
        self.due
    }

    #[inline(never)] // as the next one: what they need of the stack is needed one after the other
    fn beat(&mut self, task: &mut Task, api: Api) {
        while let Some(response) = self.controller.timer(now(task)) {
            follow(task, &mut self.controller, response, api);
        }
    }

    /// Asks what rules depend on. What finds no room now is asked with the next beat.
    #[inline(never)] // likewise
    fn ask_sensors(&mut self, task: &mut Task, api: Api) {
        for sense in self.controller.asks() {
            let _ = api.request(task, TaskCode::HORMONE, Request::Read(sense.sensor()));
        }
    }

    /// Where the joints are to be. Sets when there will be more to do.
    #[inline(never)]
    fn posture(&mut self, now: Ticks) -> Option<Posture> {
        let beat = self.controller.next_due(now).unwrap_or(LONGEST);
        let posture = self.controller.until_posture(now).unwrap_or(LONGEST);
        self.due = now.wrapping_add(beat.min(posture));
        self.controller.posture(now)
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

/// A device answered.
fn read(controller: &mut Controller, payload: &[u8]) {
    for sense in Sense::ALL {
        if let Some(value) = Report::value_of(sense.sensor(), payload) {
            controller.read(sense, value);
        }
    }
}

/// A behaviour of this module orders the robot about. `None` if it does not.
fn obey(task: &mut Task, controller: &mut Controller, payload: &[u8]) -> Option<Response> {
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
        let payload = hormone.to_payload();
        for dock in docks.iter() {
            let to = Address::beyond(dock, TaskCode::HORMONE);
            let from = Address::here(TaskCode::HORMONE);
            let Ok(message) = Message::of_kind(to, from, payload.bytes(), hormone.kind()) else { continue };
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
