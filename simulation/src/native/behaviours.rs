//! The behaviours of a module: AC_SEND, AC_RECV and HORMONE, as their tasks drive them.

use std::hash::{Hash, Hasher};

use hormone::action::{Docking, Posture};
use hormone::controller::{Controller, Outgoing, Response};
use hormone::event::Event;
use hormone::gait::Gait;
use hormone::hormone::Hormone;
use hormone::probe::Probe;
use hormone::schedule::Schedule;
use hormone::sense::Sense;
use hormone::status::Status;
use hormone::task::ac_receive::LOOK;
use hormone::topology::{self, Topology, to_bytes};
use tasks::dock::Dock;
use tasks::message::{Address, Letter, Message, TaskCode};
use tasks::sensor::Sensor;

use super::time::{ACT, Clock, NEXT, READ, TELL, TICK, WAKE};

pub struct Behaviours {
    pub clock: Clock,
    topology: Topology,
    schedule: Schedule,
    controller: Controller,
    /// When AC_SEND, AC_RECV and HORMONE are woken by their timers.
    probe_at: u64,
    look_at: u64,
    beat_at: Option<u64>,
    /// What the docks were asked for last.
    asked: Option<Docking>,
    /// What sensors were asked for, and when they answer.
    questions: Vec<(u64, Sense)>,
    /// Where the joints were told to be before the last input.
    pub told: Option<Posture>,
}

impl Hash for Behaviours {
    fn hash<H: Hasher>(&self, state: &mut H) {
        let Status { hormones_received, hormones_sent, topology_changes, neighbours, action, .. } =
            *self.status();
        (hormones_received, hormones_sent, topology_changes, neighbours, action as u8).hash(state);
        (self.probe_at, self.look_at, self.beat_at).hash(state);
    }
}

/// What behaviours do: all lists are of the same moment.
#[derive(Default)]
pub struct Doing {
    pub events: Vec<(u64, Event)>,
    /// Messages to be sent, and when.
    pub messages: Vec<(u64, Letter)>,
    /// What docks are asked for.
    pub dockings: Vec<(u64, Docking)>,
}

impl Behaviours {
    /// The behaviours of a module whose clock starts at `first_tick`. `seed` should differ from module to
    /// module and from boot to boot.
    pub fn new(first_tick: u64, gait: Gait, seed: u16) -> Self {
        let controller = Controller::new(gait, seed, 0);
        Behaviours {
            clock: Clock { started_at: first_tick },
            topology: Topology::new(),
            schedule: Schedule::new(0),
            controller,
            probe_at: first_tick,
            look_at: first_tick,
            beat_at: None,
            asked: None,
            questions: Vec::new(),
            told: None,
        }
    }

    pub fn status(&self) -> &Status {
        self.controller.status()
    }

    /// Where the joints were told to be last; `None` if they were told nothing yet.
    pub fn posture(&self, now: u64) -> Option<Posture> {
        self.controller.posture(self.clock.ticks(now)).or(self.told)
    }

    /// When a timer is next up.
    pub fn due(&self) -> u64 {
        let answer_at = self.questions.iter().map(|question| question.0).min();
        let [beat_at, answer_at] = [self.beat_at, answer_at].map(|at| at.unwrap_or(u64::MAX));
        self.probe_at.min(self.look_at).min(beat_at).min(answer_at)
    }

    /// Does what timers are up for, and takes in what sensors answer.
    pub fn wake(&mut self, now: u64, acceleration: [f64; 3], doing: &mut Doing) {
        for (_, sense) in self.questions.extract_if(.., |question| question.0 <= now) {
            if let Some(value) = value(sense.sensor(), acceleration) {
                self.controller.read(sense, value);
            }
        }
        if self.probe_at <= now {
            self.probe(now, doing);
        }
        if self.look_at <= now {
            self.look_at = self.clock.tick(now) + u64::from(LOOK) * TICK;
            let clock = self.clock.ticks(now);
            let is_news = self.topology.expire(clock);
            if self.schedule.set_quick(self.topology.lossy(clock), clock) {
                self.probe_at = now;
            }
            if is_news {
                self.tell(now, doing);
            }
        }
        if self.beat_at.is_some_and(|at| at <= now) {
            self.beat(now, doing);
        }
    }

    /// AC_SEND.
    fn probe(&mut self, now: u64, doing: &mut Doing) {
        let clock = self.clock.ticks(now);
        let mut at = now + TELL;
        while let Some(dock) = self.schedule.due(clock) {
            let to = Address::beyond(dock, TaskCode::AC_RECEIVE);
            let from = Address::here(TaskCode::AC_RECEIVE);
            let probe = self.topology.probe(dock, clock).to_byte();
            doing
                .messages
                .extend(Message::datagram(to, from, &[probe]).ok().map(|message| (at, Letter::of(message))));
            at += TELL;
        }
        self.probe_at = self.clock.tick(now) + u64::from(self.schedule.next_due(clock).max(1)) * TICK;
    }

    /// A message has come for a behaviour.
    pub fn take(&mut self, now: u64, message: &Letter, doing: &mut Doing) {
        match (message.to().task(), message.from().dock()) {
            (TaskCode::AC_RECEIVE, Some(dock)) => self.hear(now, dock, message.payload(), doing),
            (TaskCode::HORMONE, Some(dock)) => self.receive(now, dock, message.payload(), doing),
            (TaskCode::HORMONE, None) => self.learn(now, message.payload(), doing),
            _ => {}
        }
    }

    /// AC_RECV.
    fn hear(&mut self, now: u64, dock: Dock, payload: &[u8], doing: &mut Doing) {
        let Some(probe) = Probe::from_payload(payload) else { return };
        let heard = self.topology.heard(dock, probe, self.clock.ticks(now));
        if heard.answer {
            self.schedule.hurry(dock);
            self.probe_at = now + TELL;
        }
        if heard.changed {
            self.tell(now, doing);
        }
    }

    fn tell(&self, now: u64, doing: &mut Doing) {
        let [to, from] = [TaskCode::HORMONE, TaskCode::AC_RECEIVE].map(Address::here);
        let neighbours = to_bytes(&self.topology.neighbours());
        let message = Message::new(to, from, &neighbours);
        doing.messages.extend(message.ok().map(|message| (now + TELL, Letter::of(message))));
    }

    /// HORMONE: a neighbour sent a hormone.
    fn receive(&mut self, now: u64, dock: Dock, payload: &[u8], doing: &mut Doing) {
        let clock = self.clock.ticks(now);
        self.told = self.posture(now);
        match Hormone::from_payload(payload) {
            Some(hormone) => {
                let response = self.controller.received(dock, hormone, clock);
                self.follow(now, response, doing);
            }
            None => self.controller.malformed(),
        }
        self.beat(now, doing);
    }

    /// HORMONE: AC_RECV reported the neighbours.
    fn learn(&mut self, now: u64, payload: &[u8], doing: &mut Doing) {
        self.told = self.posture(now);
        if let Some(neighbours) = topology::from_bytes(payload) {
            let response = self.controller.topology(&neighbours, self.clock.ticks(now));
            self.follow(now, response, doing);
        }
        self.beat(now, doing);
    }

    /// HORMONE looks at the clock, as it does after each message and when its timer is up.
    fn beat(&mut self, now: u64, doing: &mut Doing) {
        let clock = self.clock.ticks(now);
        self.told = self.posture(now);
        while let Some(response) = self.controller.timer(clock) {
            self.follow(now + WAKE, response, doing);
        }
        let wanted = self.status().action.docking();
        if wanted != self.asked {
            self.asked = wanted;
            doing.dockings.extend(wanted.map(|docking| (now, docking)));
        }
        self.questions.extend(self.controller.asks().map(|sense| (now + READ, sense)));
        let wait = self.controller.next_due(clock);
        self.beat_at = wait.map(|wait| self.clock.tick(now) + u64::from(wait.max(1)) * TICK);
    }

    fn follow(&mut self, now: u64, response: Response, doing: &mut Doing) {
        doing.events.extend(response.event.map(|event| (now, event)));
        let mut at = now;
        if let Some(Outgoing { hormone, docks }) = response.send {
            for (number, dock) in docks.iter().enumerate() {
                at += if number == 0 { ACT } else { NEXT };
                let to = Address::beyond(dock, TaskCode::HORMONE);
                let from = Address::here(TaskCode::HORMONE);
                let payload = hormone.to_payload();
                let Ok(message) = Message::of_kind(to, from, payload.bytes(), hormone.kind()) else {
                    continue;
                };
                self.controller.sent();
                if let Hormone::Pace(pace) = hormone {
                    doing.events.push((at, Event::HormoneSent(dock, pace.data)));
                }
                doing.messages.push((at, Letter::of(message)));
            }
        }
        doing.events.extend(response.action.map(|action| (at, Event::ActionBegun(action))));
    }
}

/// What a sensor reads, in its unit; of all there is the accelerometer alone.
pub fn value(sensor: Sensor, acceleration: [f64; 3]) -> Option<i16> {
    let [x, y, z] = acceleration.map(|axis| (axis * 1000.0) as i16);
    match sensor {
        Sensor::AccelerationX => Some(x),
        Sensor::AccelerationY => Some(y),
        Sensor::AccelerationZ => Some(z),
        _ => None,
    }
}
