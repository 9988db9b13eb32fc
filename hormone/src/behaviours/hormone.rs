//! HORMONE: acts on topology, timer and hormones, and propagates hormones.

use tasks::dock::Dock;
use tasks::message::{Address, Held, Message, TaskCode};
use tasks::request::{Report, Request};

use super::docks::Docks;
use super::joints::Joints;
use crate::action::Posture;
use crate::controller::{Controller, NOTHING, Outgoing, Response};
use crate::event::Event;
use crate::gait::Gait;
use crate::hormone::Hormone;
use crate::module::Module;
use crate::sense::Sense;
use crate::standing::Standing;
use crate::status::Status;
use crate::time::{LONGEST, reached, until};
use crate::topology;

/// How soon the count of messages that could not be read is shown, in ticks of 1 ms.
const SHOWN_WITHIN: u16 = 20;

/// It looks at the clock this often though nothing is due, in milliseconds: so no moment that is over comes
/// to count as one that lies ahead.
const AT_LEAST_EVERY: u16 = LONGEST / 2;

/// The state of HORMONE, and what it told the joints and docks.
pub struct Behaviour {
    controller: Controller,
    joints: Joints,
    docks: Docks,
    /// When it has something to do.
    due: u16,
}

impl Behaviour {
    /// A module at power-up; see [`Controller::new`].
    #[inline(never)] // else a copy of it would stay on the stack
    pub fn new(gait: Gait, seed: u16, now: u16) -> Self {
        let controller = Controller::new(gait, seed, now);
        Behaviour { controller, joints: Joints::new(), docks: Docks::new(), due: now }
    }

    /// Does what a message asks for.
    #[inline(never)]
    pub fn receive(&mut self, now: u16, message: impl Held, module: &mut impl Module) {
        let controller = &mut self.controller;
        let letter = message.letter();
        let response = match letter.from().dock() {
            Some(dock) => receive(now, controller, dock, letter.payload()),
            None if letter.from().task() == TaskCode::AC_RECEIVE => learn(now, controller, letter.payload()),
            None if letter.from().task().is_behaviour() => obey(now, controller, letter.payload()),
            None => {
                // Of what devices report, no more matters.
                if let Some((axis, state)) = Report::of_joint(letter.payload()) {
                    self.joints.hear(now, axis, state);
                }
                if read(controller, letter.payload()) {
                    // It counts from the next beat on.
                    return;
                }
                Some(recall(now, controller, letter.payload()))
            }
        };
        // Its buffer is needed for what goes out.
        drop(message);
        let Some(response) = response else { return self.malformed(now) };
        follow(controller, response, module);
        self.due = now;
    }

    /// Counts a message that could not be read. A flood of them shall not keep the module busy.
    fn malformed(&mut self, now: u16) {
        self.controller.malformed();
        self.due_within(SHOWN_WITHIN, now);
    }

    /// Has something to do in so many milliseconds, if not sooner.
    fn due_within(&mut self, milliseconds: u16, now: u16) {
        if milliseconds < until(self.due, now) {
            self.due = now.wrapping_add(milliseconds);
        }
    }

    /// Does what it is time for, after a message too. Returns whether it did anything.
    pub fn act(&mut self, now: u16, module: &mut impl Module) -> bool {
        if !reached(self.due, now) {
            return false;
        }
        self.beat(now, module);
        let posture = self.posture(now);
        self.turn(now, posture, module);
        self.keep(module);
        self.docks.ask(self.controller.status().action.docking(), module);
        self.ask_sensors(now, module);
        true
    }

    /// Milliseconds from `now` until there is something to do.
    pub fn next_due(&self, now: u16) -> u16 {
        until(self.due, now)
    }

    /// Its view of the module, whose AC_RECV could not read `malformed` messages.
    pub fn status(&self, malformed: u16) -> Status {
        let status = *self.controller.status();
        Status { malformed: status.malformed.wrapping_add(malformed), ..status }
    }

    /// What it decides by.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    #[inline(never)] // as the next one: what they need of the stack is needed one after the other
    fn beat(&mut self, now: u16, module: &mut impl Module) {
        while let Some(response) = self.controller.timer(now) {
            follow(&mut self.controller, response, module);
        }
    }

    /// Has what stands kept without power. What finds no room now is kept the next time.
    #[inline(never)] // likewise
    fn keep(&mut self, module: &mut impl Module) {
        if let Some(record) = self.controller.to_keep()
            && module.request(Request::Keep(record)).is_ok()
        {
            self.controller.kept();
        }
    }

    /// Asks what rules depend on. What finds no room now is asked the next time. Sets when that is.
    #[inline(never)] // likewise
    fn ask_sensors(&mut self, now: u16, module: &mut impl Module) {
        for sense in self.controller.asks(now) {
            let _ = module.request(Request::Read(sense.sensor()));
        }
        if let Some(left) = self.controller.next_ask(now) {
            self.due_within(left, now);
        }
    }

    /// Tells the joints where to be. Sets when there will be more to do for them.
    #[inline(never)] // likewise
    fn turn(&mut self, now: u16, posture: Option<Posture>, module: &mut impl Module) {
        self.joints.turn(now, posture, module);
        if let Some(left) = self.joints.retry_in(now) {
            self.due_within(left, now);
        }
    }

    /// Where the joints are to be. Sets when there will be more to do.
    #[inline(never)]
    fn posture(&mut self, now: u16) -> Option<Posture> {
        let beat = self.controller.next_due(now).unwrap_or(AT_LEAST_EVERY);
        let posture = self.controller.until_posture(now).unwrap_or(AT_LEAST_EVERY);
        self.due = now.wrapping_add(beat.min(posture));
        self.controller.posture(now)
    }
}

/// A neighbour sent a hormone. `None` if it is none.
fn receive(now: u16, controller: &mut Controller, dock: Dock, payload: &[u8]) -> Option<Response> {
    let hormone = Hormone::from_payload(payload)?;
    Some(controller.received(dock, hormone, now))
}

/// AC_RECV reported the neighbours. `None` if these can't be.
fn learn(now: u16, controller: &mut Controller, payload: &[u8]) -> Option<Response> {
    let neighbours = topology::from_bytes(payload)?;
    Some(controller.topology(&neighbours, now))
}

/// A device answered. Returns whether this was what a sensor reads that a sense goes by.
#[inline(never)] // its stack is needed here alone
fn read(controller: &mut Controller, payload: &[u8]) -> bool {
    let mut is_reading = false;
    for sense in Sense::ALL {
        if let Some(value) = Report::value_of(sense.sensor(), payload) {
            controller.read(sense, value);
            is_reading = true;
        }
    }
    is_reading
}

/// The memory told what it kept.
fn recall(now: u16, controller: &mut Controller, payload: &[u8]) -> Response {
    match Report::kept(payload).and_then(Standing::from_record) {
        Some(standing) => controller.recall(standing, now),
        None => NOTHING,
    }
}

/// A behaviour of this module orders the robot about. `None` if it does not.
fn obey(now: u16, controller: &mut Controller, payload: &[u8]) -> Option<Response> {
    match Hormone::from_payload(payload)? {
        Hormone::Order(order) => Some(controller.order(None, order, now)),
        _ => None,
    }
}

/// Sends what is to be sent, and tells what happened.
fn follow(controller: &mut Controller, response: Response, module: &mut impl Module) {
    if let Some(event) = response.event {
        module.trace(event);
    }
    if let Some(Outgoing { hormone, docks }) = response.send {
        let payload = hormone.to_payload();
        for dock in docks.iter() {
            let to = Address::beyond(dock, TaskCode::HORMONE);
            let from = Address::here(TaskCode::HORMONE);
            let Ok(message) = Message::of_kind(to, from, payload.as_slice(), hormone.kind()) else {
                continue;
            };
            match module.send(message) {
                Ok(()) => {
                    controller.sent();
                    if let Hormone::Pace(pace) = hormone {
                        module.trace(Event::HormoneSent(dock, pace.data));
                    }
                }
                Err(_) => controller.unsent(),
            }
        }
    }
    if let Some(action) = response.action {
        module.trace(Event::ActionBegun(action));
    }
}
