//! One module: behaviours on the master, three docks on each MCU, and what is under way between them.

use std::hash::{Hash, Hasher};

use hormone::action::{Docking, Posture};
use hormone::behaviours::Behaviours;
use hormone::event::Event;
use hormone::gait::Gait;
use hormone::status::Status;
use tasks::bridge::protocol::BridgeCounters;
use tasks::dock::{Dock, DockSet};
use tasks::link::counters::LinkCounters;
use tasks::message::{Address, Letter, Message, TaskCode};
use tasks::post_office::Undelivered;
use tasks::request::{Report, Request};
use tasks::router::{Mcu, Source};
use tasks::sensor::Sensor;

use super::behaviours::Here;
use super::devices::{Devices, value};
use super::embodied::Embodied;
use super::inside::{Input, Inside};
use super::port::{Flight, Port};
use super::time::{Clock, RECALL, START, TICK, WAKE};
use crate::change::Mcus;
use crate::hardware::{CHARACTER, START_UP, is_on_pins, is_on_slave};
use crate::pose::Angles;
use crate::random::Random;

pub struct Module {
    /// From when on it has power.
    pub powered_up_at: u64,
    pub is_on: bool,
    /// The gait that it begins with.
    gait: Gait,
    random: Random,
    /// From when on the master's and the slave's programs run.
    live_since: [u64; 2],
    /// The master's and the slave's.
    clocks: [Clock; 2],
    behaviours: Behaviours,
    /// When the behaviours are polled even if nothing comes.
    poll_at: u64,
    /// Along x, y and z of the half with the Front dock, in multiples of the acceleration of gravity.
    pub acceleration: [f64; 3],
    ports: [Port; 6],
    /// When the sending task of each dock has something to do, but for those that were touched since.
    send_at: [u64; 6],
    touched: DockSet,
    inside: Inside,
}

impl Hash for Module {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.is_on.hash(state);
        let Status { hormones_received, hormones_sent, topology_changes, neighbours, action, .. } =
            self.behaviours.status();
        (hormones_received, hormones_sent, topology_changes, neighbours, action as u8).hash(state);
        self.poll_at.hash(state);
        self.ports.iter().for_each(|port| port.hash(state));
        self.inside.hash(state);
        self.acceleration.map(f64::to_bits).hash(state);
    }
}

/// A module's output.
#[derive(Default)]
pub struct Output {
    pub flights: Vec<(Dock, Flight)>,
    pub events: Vec<(u64, Event)>,
    pub dockings: Vec<(u64, Docking)>,
}

impl Module {
    /// A module whose power comes at `powered_up_at`.
    pub fn new(powered_up_at: u64, gait: Gait, mut random: Random) -> Self {
        let live = powered_up_at + START;
        Module {
            powered_up_at,
            is_on: true,
            live_since: [live; 2],
            clocks: [Clock { started_at: live }; 2],
            behaviours: Behaviours::new(gait, random.next_u64() as u16, 0),
            poll_at: live,
            gait,
            acceleration: [0.0, 0.0, 1.0],
            ports: Dock::ALL
                .map(|dock| Port::new(dock, random.next_u64() as u16, Clock { started_at: live })),
            send_at: [u64::MAX; 6],
            touched: DockSet::EMPTY,
            inside: Inside::new(live),
            random,
        }
    }

    /// The module's view of itself; `None` while its master's program does not run yet.
    pub fn status(&self, now: u64) -> Option<Status> {
        (self.live_since[Mcu::Master as usize] <= now).then(|| self.behaviours.status())
    }

    /// Where the joints are: without a world where they were told to be last, and straight if they were told
    /// nothing yet.
    pub fn angles(&self) -> Angles {
        let Devices { embodied, .. } = &self.inside.devices;
        match (embodied, self.inside.devices.posture()) {
            (Some(embodied), _) => embodied.body.angles(),
            (None, Some(Posture { motor0, roll, motor2 })) => [motor0, roll, motor2].map(f64::from),
            (None, None) => [0.0; 3],
        }
    }

    /// Gives the module a body in a world.
    pub fn embody(&mut self, embodied: Box<Embodied>) {
        self.inside.devices.embodied = Some(embodied);
    }

    pub fn embodied(&self) -> Option<&Embodied> {
        self.inside.devices.embodied.as_deref()
    }

    pub fn embodied_mut(&mut self) -> Option<&mut Embodied> {
        self.inside.devices.embodied.as_deref_mut()
    }

    /// A millisecond begins, in which the body does what the programs have it do.
    pub fn drive(&mut self, now: u64) {
        let runs = self.live_since.map(|live| self.is_on && live <= now);
        let Some(embodied) = self.embodied_mut() else { return };
        let acceleration = embodied.body.acceleration;
        let told = embodied.step(runs);
        self.feel(acceleration);
        for (mcu, letters) in Mcu::ALL.into_iter().zip(told) {
            for letter in letters {
                // A message that finds no room is lost, as on the MCUs.
                let _ = self.deliver(now, mcu, letter.message(), Source::Task);
            }
        }
    }

    /// Sets what the accelerometer reads from now on.
    pub fn feel(&mut self, acceleration: [f64; 3]) {
        self.acceleration = acceleration;
    }

    pub fn links(&self) -> impl Iterator<Item = LinkCounters> {
        self.ports.iter().map(Port::counters)
    }

    /// The bridge's counts, both sides together.
    pub fn bridge(&self) -> &BridgeCounters {
        &self.inside.bridge
    }

    /// When something is next due.
    pub fn due(&self) -> u64 {
        if !self.is_on {
            return u64::MAX;
        }
        let send = self.send_at.iter().copied().min().unwrap_or(u64::MAX);
        self.inside.due().min(send).min(self.poll_at)
    }

    /// Does all that is due before `end`. Returns when more is.
    pub fn run(&mut self, start: u64, end: u64, output: &mut Output) -> u64 {
        loop {
            let due = self.due();
            if due >= end {
                return due;
            }
            self.act(due.max(start), output);
        }
    }

    fn act(&mut self, now: u64, output: &mut Output) {
        while let Some(input) = self.inside.take(now) {
            self.take(now, input, output);
        }
        if self.poll_at <= now {
            self.behave(now, None, output);
        }
        let clocks = self.clocks;
        let ports = Dock::ALL.into_iter().zip(&mut self.ports).zip(&mut self.send_at);
        for ((dock, port), send_at) in ports {
            if *send_at <= now || self.touched.contains(dock) {
                if port.due(now).is_some_and(|due| due <= now) {
                    let flight = port.send(now, clocks[mcu_of(dock) as usize]);
                    output.flights.extend(flight.map(|flight| (dock, flight)));
                }
                *send_at = port.due(now).unwrap_or(u64::MAX);
            }
        }
        self.touched = DockSet::EMPTY;
    }

    /// Lets the behaviours take a message, and do what is due.
    fn behave(&mut self, now: u64, message: Option<Letter>, output: &mut Output) {
        let Module { behaviours, inside, ports, .. } = self;
        let clock = self.clocks[Mcu::Master as usize];
        let events = &mut output.events;
        let mut here = Here { inside, ports, events, at: now, has_acted: false };
        let ticks = clock.ticks(now);
        match message {
            Some(message) => behaviours.receive(ticks, message, &mut here),
            None => here.at += WAKE,
        }
        behaviours.poll(ticks, &mut here);
        self.poll_at = clock.cycle(behaviours.poll_at(ticks), now).max(clock.tick(now) + TICK);
        output.dockings.append(&mut self.inside.devices.dockings);
    }

    fn take(&mut self, now: u64, input: Input, output: &mut Output) {
        match input {
            Input::Begun(dock, span) => self.ports[usize::from(dock.index())].expect(span),
            Input::Frame(dock, flight) => self.receive(now, dock, &flight),
            Input::Crossed(mcu, message) => {
                let live = self.live_since[mcu as usize];
                if now < live {
                    return self.inside.send_again(now, mcu, message, live);
                }
                let delivered = self.deliver(now, mcu, message.message(), Source::Bridge);
                self.inside.count_crossed(delivered);
                output.dockings.append(&mut self.inside.devices.dockings);
            }
            Input::Taken(message) => self.behave(now, Some(message), output),
            Input::Read(sensor, client) => {
                if let Some(answer) = answer(sensor, client, self.acceleration) {
                    self.behave(now, Some(answer), output);
                }
            }
            Input::Sent(dock, message) => {
                // There was room when it was sent.
                self.port(dock).put(message);
            }
        }
    }

    /// A frame is sent to a dock. Returns when the module first knows of it.
    pub fn arrive(&mut self, dock: Dock, flight: Flight) -> Option<u64> {
        if !self.is_on || flight.span.start < self.live_since[mcu_of(dock) as usize] {
            return None;
        }
        // A port on pins sees the first edge; a USART tells of a character at its end.
        let begun_at = flight.span.start + if is_on_pins(dock) { 0 } else { CHARACTER };
        self.inside.insert(begun_at, Input::Begun(dock, flight.span.clone()));
        self.inside.insert(flight.taken_at(), Input::Frame(dock, flight));
        Some(begun_at)
    }

    /// What comes in at a dock is no frame.
    pub fn garbled(&mut self, dock: Dock) {
        self.port(dock).garbled();
    }

    fn receive(&mut self, now: u64, dock: Dock, flight: &Flight) {
        let heard = if is_on_pins(dock) { Some(&flight.span) } else { flight.shared.as_ref() };
        if heard.is_some_and(|span| self.port(dock).has_drowned(span)) {
            return self.garbled(dock);
        }
        self.touched.insert(dock);
        let ticks = self.clocks[mcu_of(dock) as usize].ticks(now);
        // Without a body a dock has no latch.
        let is_open = self.embodied().is_some_and(|it| it.is_open(dock));
        let inside = &mut self.inside;
        let port = &mut self.ports[usize::from(dock.index())];
        port.receive(ticks, &flight.wire, is_open, |message| {
            // What comes in by a dock does not go out by another: the router sees to that.
            inside.deliver(now, mcu_of(dock), message, Source::Dock(dock)).map(|_| ())
        });
    }

    /// Hands a message on as the router says.
    fn deliver(&mut self, now: u64, mcu: Mcu, message: Message, source: Source) -> Result<(), Undelivered> {
        match self.inside.deliver(now, mcu, message, source)? {
            Some(dock) if !self.port(dock).put(Letter::of(message)) => Err(Undelivered::NoRoom),
            _ => Ok(()),
        }
    }

    /// Programs start over.
    pub fn reset(&mut self, now: u64, mcus: Mcus) {
        let is_reset = |mcu: Mcu| mcus.contains(mcu);
        let live = (now + START_UP).max(self.powered_up_at) + START;
        for mcu in Mcu::ALL.into_iter().filter(|mcu| is_reset(*mcu)) {
            self.live_since[mcu as usize] = live;
            self.clocks[mcu as usize] = Clock { started_at: live };
        }
        for (dock, port) in Dock::ALL.into_iter().zip(&mut self.ports) {
            if is_reset(mcu_of(dock)) {
                *port = Port::new(dock, self.random.next_u64() as u16, Clock { started_at: live });
                self.touched.insert(dock);
            }
        }
        if is_reset(Mcu::Master) {
            self.behaviours = Behaviours::new(self.gait, self.random.next_u64() as u16, 0);
            self.poll_at = live;
        }
        if let Some(embodied) = self.embodied_mut() {
            embodied.reset(is_reset);
        }
        self.inside.reset(is_reset, mcu_of);
        if is_reset(Mcu::Master)
            && let Some(record) = self.inside.devices.recall()
        {
            let (to, from) = (Address::here(TaskCode::HORMONE), Address::here(TaskCode::MEMORY));
            if let Ok(message) = Message::new(to, from, &Report::Kept(record).to_payload()) {
                self.inside.insert(live + RECALL, Input::Taken(Letter::of(message)));
            }
        }
    }

    fn port(&mut self, dock: Dock) -> &mut Port {
        self.touched.insert(dock);
        &mut self.ports[usize::from(dock.index())]
    }
}

/// The MCU that a dock is on.
pub fn mcu_of(dock: Dock) -> Mcu {
    if is_on_slave(dock) { Mcu::Slave } else { Mcu::Master }
}

/// A sensor's answer to a task; `None` if there is no such sensor.
fn answer(sensor: Sensor, client: TaskCode, acceleration: [f64; 3]) -> Option<Letter> {
    let report = Report::Value(sensor, value(sensor, acceleration)?).to_payload();
    let from = Request::Read(sensor).task();
    let message = Message::new(Address::here(client), Address::here(from), &report);
    message.ok().map(Letter::of)
}
