//! HORMONE: acts on topology, timer and hormones, and propagates hormones.

use tasks::dock::Dock;
use tasks::message::{Address, Held, Message, TaskCode};
use tasks::request::{Report, Request};

use super::docks::{Docks, Wish};
use super::joints::{Joints, RETRY};
use crate::action::Posture;
use crate::controller::{Controller, NOTHING, Outgoing, Response};
use crate::event::Event;
use crate::gait::Gait;
use crate::hormone::Hormone;
use crate::module::Module;
use crate::neighbours;
use crate::sense::Sense;
use crate::standing::Standing;
use crate::status::Status;
use crate::time::{LONGEST, reached, until};

/// How soon the status shows that a message could not be read, in ticks of 1 ms.
const SHOWN_WITHIN: u16 = 20;

/// HORMONE looks at the clock at least this often, in milliseconds, even if nothing is due: so no moment that
/// has passed comes to count as one that lies ahead.
const AT_LEAST_EVERY: u16 = LONGEST / 2;

/// The state of HORMONE, and what it told the joints and docks.
pub struct Behaviour {
    controller: Controller,
    joints: Joints,
    docks: Docks,
    /// When [`act`](Behaviour::act) next has something to do.
    due: u16,
}

impl Behaviour {
    /// A module at power-up; see [`Controller::new`].
    #[inline(never)] // else a copy of it would stay on the stack
    pub fn new(gait: Gait, seed: u16, now: u16) -> Self {
        let controller = Controller::new(gait, seed, now);
        Behaviour { controller, joints: Joints::new(), docks: Docks::new(), due: now }
    }

    /// Handles a message.
    #[inline(never)]
    pub fn receive(&mut self, now: u16, message: impl Held, module: &mut impl Module) {
        let controller = &mut self.controller;
        let letter = message.letter();
        let response = match letter.from().dock() {
            Some(dock) => receive(now, controller, dock, letter.payload()),
            None if letter.from().task() == TaskCode::AC_RECEIVE => learn(now, controller, letter.payload()),
            None if letter.from().task().is_behaviour() => obey(now, controller, letter.payload()),
            None => {
                // Of the devices' reports, only joint states, closed latches, readings and the kept
                // record matter.
                if let Some((axis, state)) = Report::of_joint(letter.payload()) {
                    self.joints.hear(now, axis, state);
                }
                if let Some(dock) = Report::latched(letter.payload()) {
                    self.docks.latched(now, dock);
                }
                if read(controller, letter.payload()) {
                    // A reading counts from the next beat on.
                    return;
                }
                Some(recall(now, controller, letter.payload()))
            }
        };
        // The messages that go out need its buffer.
        drop(message);
        let Some(response) = response else { return self.malformed(now) };
        follow(controller, response, module);
        self.due = now;
    }

    /// Counts a message that could not be read. The status shows it only within [`SHOWN_WITHIN`], so that a
    /// flood of them does not keep the module busy.
    fn malformed(&mut self, now: u16) {
        self.controller.malformed();
        self.due_within(SHOWN_WITHIN, now);
    }

    /// Makes [`act`](Self::act) due in so many milliseconds, if it is not due sooner.
    fn due_within(&mut self, milliseconds: u16, now: u16) {
        if milliseconds < until(self.due, now) {
            self.due = now.wrapping_add(milliseconds);
        }
    }

    /// Does what is due; call it after messages too. Returns whether anything was due.
    pub fn act(&mut self, now: u16, module: &mut impl Module) -> bool {
        if !reached(self.due, now) {
            return false;
        }
        self.beat(now, module);
        let posture = self.posture(now);
        self.turn(now, posture, module);
        self.keep(now, module);
        self.dock(now, module);
        self.ask_sensors(now, module);
        true
    }

    /// Milliseconds from `now` until there is something to do.
    pub fn next_due(&self, now: u16) -> u16 {
        until(self.due, now)
    }

    /// HORMONE's view of the module. `malformed` is the number of messages that AC_RECV could not read.
    pub fn status(&self, malformed: u16) -> Status {
        let status = *self.controller.status();
        Status { malformed: status.malformed.wrapping_add(malformed), ..status }
    }

    /// The state by which it decides.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    #[inline(never)] // as those below: their stack frames follow each other instead of adding up
    fn beat(&mut self, now: u16, module: &mut impl Module) {
        while let Some(response) = self.controller.timer(now) {
            follow(&mut self.controller, response, module);
        }
    }

    /// Has the memory keep the standing order. If there is no room now, it tries again after [`RETRY`].
    #[inline(never)] // as `beat`
    fn keep(&mut self, now: u16, module: &mut impl Module) {
        let Some(record) = self.controller.to_keep() else { return };
        match module.request(Request::Keep(record)) {
            Ok(()) => self.controller.kept(),
            // A robot that stands may have nothing else to do, and may be switched off.
            Err(_) => self.due_within(RETRY, now),
        }
    }

    /// Tells the docks what the present action wants of them, has searches end if the robot is to stop, and
    /// opens a latch that has missed. If there is no room now, it tries again after [`RETRY`]: a robot that
    /// stands may have nothing else to do.
    #[inline(never)] // as `beat`
    fn dock(&mut self, now: u16, module: &mut impl Module) {
        let wish = match self.controller.status().action.docking() {
            _ if self.controller.is_halted() => Wish::Stand,
            Some(docking) => Wish::Docking(docking),
            None => Wish::Nothing,
        };
        let neighbours = &self.controller.status().neighbours;
        if !(self.docks.ask(wish, module) && self.docks.open_missed(now, neighbours, module)) {
            self.due_within(RETRY, now);
        } else if let Some(left) = self.docks.holds_in(now) {
            self.due_within(left, now);
        }
    }

    /// Asks the sensors that rules depend on, and sets when to ask again. A request that finds no room waits
    /// until then.
    #[inline(never)] // as `beat`
    fn ask_sensors(&mut self, now: u16, module: &mut impl Module) {
        for sense in self.controller.asks(now) {
            let _ = module.request(Request::Read(sense.sensor()));
        }
        if let Some(left) = self.controller.next_ask(now) {
            self.due_within(left, now);
        }
    }

    /// Tells the joints where to be, and sets when they need a retry.
    #[inline(never)] // as `beat`
    fn turn(&mut self, now: u16, posture: Option<Posture>, module: &mut impl Module) {
        self.joints.turn(now, posture, module);
        if let Some(left) = self.joints.retry_in(now) {
            self.due_within(left, now);
        }
    }

    /// Where the joints are to be. Sets when the next beat or posture is due.
    #[inline(never)]
    fn posture(&mut self, now: u16) -> Option<Posture> {
        let beat = self.controller.next_due(now).unwrap_or(AT_LEAST_EVERY);
        let posture = self.controller.until_posture(now).unwrap_or(AT_LEAST_EVERY);
        self.due = now.wrapping_add(beat.min(posture));
        self.controller.posture(now)
    }
}

/// Handles a hormone from a neighbour. `None` if the payload is none.
fn receive(now: u16, controller: &mut Controller, dock: Dock, payload: &[u8]) -> Option<Response> {
    let hormone = Hormone::from_payload(payload)?;
    Some(controller.received(dock, hormone, now))
}

/// Handles AC_RECV's report of the neighbours. `None` if the payload is no topology.
fn learn(now: u16, controller: &mut Controller, payload: &[u8]) -> Option<Response> {
    let neighbours = neighbours::from_bytes(payload)?;
    Some(controller.topology(&neighbours, now))
}

/// Handles a device's answer. Returns whether it was the reading of a sensor that a sense depends on.
#[inline(never)] // keeps its stack frame out of the caller's
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

/// Handles the record that the memory kept.
fn recall(now: u16, controller: &mut Controller, payload: &[u8]) -> Response {
    match Report::kept(payload).and_then(Standing::from_record) {
        Some(standing) => controller.recall(standing, now),
        None => NOTHING,
    }
}

/// Handles an order from a behaviour of this module. `None` if the payload is no order.
fn obey(now: u16, controller: &mut Controller, payload: &[u8]) -> Option<Response> {
    match Hormone::from_payload(payload)? {
        Hormone::Order(order) => Some(controller.order(None, order, now)),
        _ => None,
    }
}

/// Sends the hormone of a response, and traces its events.
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
