//! One module: behaviours on the master, three docks on each MCU, and the bridge between.

use std::hash::{Hash, Hasher};
use std::mem;
use std::ops::Range;

use hormone::action::{Docking, Posture};
use hormone::event::Event;
use hormone::gait::Gait;
use hormone::status::Status;
use tasks::bridge::protocol::BridgeCounters;
use tasks::bridge::task::ROOM;
use tasks::dock::{Dock, DockSet};
use tasks::link::counters::LinkCounters;
use tasks::message::{Letter, Message};
use tasks::post_office::Undelivered;
use tasks::router::{Mcu, Route, Router, Source};

use super::behaviours::{Behaviours, Doing};
use super::port::{Flight, Port};
use super::time::{CHARACTER, CROSS_AFTER, CROSS_BEFORE, Clock, START, WAKE, transfer};
use crate::change::Mcus;
use crate::hardware::{RESIDENCE, START_UP, is_deaf_while_it_sends, is_on_slave};
use crate::random::Random;

const MASTER: Router = Router::new(Mcu::Master, RESIDENCE);
const SLAVE: Router = Router::new(Mcu::Slave, RESIDENCE);

/// Something that is to happen inside a module.
enum Input {
    /// The first character of a frame has come in at a dock.
    Begun(Dock, Range<u64>),
    /// A frame has come in at a dock.
    Frame(Dock, Flight),
    /// A message has crossed to an MCU.
    Crossed(Mcu, Letter),
    /// A behaviour takes a message.
    Taken(Letter),
    /// A behaviour sends a message.
    Sent(Letter),
}

pub struct Module {
    /// From when on it has power.
    pub powered_up_at: u64,
    pub is_on: bool,
    /// The gait that it begins with.
    gait: Gait,
    random: Random,
    /// From when on the master's and the slave's programs run.
    live_since: [u64; 2],
    behaviours: Behaviours,
    /// Along x, y and z of the half with the Front dock, in multiples of the acceleration of gravity.
    pub acceleration: [f64; 3],
    ports: [Port; 6],
    /// When the sending task of each dock has something to do, but for those that were touched since.
    send_at: [u64; 6],
    touched: DockSet,
    inside: Inside,
}

/// What is under way inside a module.
struct Inside {
    /// The latest first.
    inputs: Vec<(u64, Input)>,
    /// Until when the two-wire bus is busy.
    bus_until: u64,
    /// Messages that cross to the master and to the slave now.
    crossing: [u8; 2],
    bridge: BridgeCounters,
}

impl Hash for Module {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.is_on.hash(state);
        self.behaviours.hash(state);
        self.ports.iter().for_each(|port| port.hash(state));
        self.inside.inputs.iter().for_each(|(at, input)| {
            at.hash(state);
            mem::discriminant(input).hash(state);
        });
        self.inside.bus_until.hash(state);
        self.acceleration.map(f64::to_bits).hash(state);
    }
}

/// What a module does to the outside.
#[derive(Default)]
pub struct Output {
    pub flights: Vec<(Dock, Flight)>,
    pub events: Vec<(u64, Event)>,
    pub dockings: Vec<(u64, Docking)>,
    doing: Doing,
}

impl Module {
    /// A module whose power comes at `powered_up_at`.
    pub fn new(powered_up_at: u64, gait: Gait, mut random: Random) -> Self {
        let live = powered_up_at + START;
        Module {
            powered_up_at,
            is_on: true,
            live_since: [live; 2],
            behaviours: Behaviours::new(live, gait, random.next_u64() as u16),
            gait,
            acceleration: [0.0, 0.0, 1.0],
            ports: Dock::ALL
                .map(|dock| Port::new(dock, random.next_u64() as u16, Clock { started_at: live })),
            send_at: [u64::MAX; 6],
            touched: DockSet::EMPTY,
            inside: Inside {
                inputs: Vec::new(),
                bus_until: live,
                crossing: [0; 2],
                bridge: BridgeCounters::default(),
            },
            random,
        }
    }

    /// What the module says of itself; `None` while its master's program does not run yet.
    pub fn status(&self, now: u64) -> Option<Status> {
        (self.live_since[Mcu::Master as usize] <= now).then(|| *self.behaviours.status())
    }

    /// Where the joints were told to be last; `None` if they were told nothing yet.
    pub fn posture(&self, now: u64) -> Option<Posture> {
        self.behaviours.posture(now)
    }

    /// What the accelerometer reads from now on.
    pub fn feel(&mut self, acceleration: [f64; 3]) {
        self.acceleration = acceleration;
    }

    pub fn links(&self) -> impl Iterator<Item = LinkCounters> {
        self.ports.iter().map(Port::counters)
    }

    /// What the bridge counts, both sides together.
    pub fn bridge(&self) -> &BridgeCounters {
        &self.inside.bridge
    }

    /// When something is next due.
    pub fn due(&self) -> u64 {
        if !self.is_on {
            return u64::MAX;
        }
        let input = self.inside.inputs.last().map_or(u64::MAX, |input| input.0);
        let send = self.send_at.iter().copied().min().unwrap_or(u64::MAX);
        input.min(send).min(self.behaviours.due())
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
        if self.behaviours.due() <= now {
            self.behaviours.wake(now, self.acceleration, &mut output.doing);
            self.follow(output);
        }
        while self.inside.inputs.last().is_some_and(|input| input.0 <= now) {
            let Some((_, input)) = self.inside.inputs.pop() else { break };
            self.take(now, input, output);
        }
        let clock = self.behaviours.clock;
        let ports = Dock::ALL.into_iter().zip(&mut self.ports).zip(&mut self.send_at);
        for ((dock, port), send_at) in ports {
            if *send_at <= now || self.touched.contains(dock) {
                if port.due(now).is_some_and(|due| due <= now) {
                    let flight = port.send(now, clock);
                    output.flights.extend(flight.map(|flight| (dock, flight)));
                }
                *send_at = port.due(now).unwrap_or(u64::MAX);
            }
        }
        self.touched = DockSet::EMPTY;
    }

    /// Takes over what the behaviours do.
    fn follow(&mut self, output: &mut Output) {
        output.events.append(&mut output.doing.events);
        output.dockings.append(&mut output.doing.dockings);
        for (at, message) in output.doing.messages.drain(..) {
            self.inside.insert(at, Input::Sent(message));
        }
    }

    fn take(&mut self, now: u64, input: Input, output: &mut Output) {
        match input {
            Input::Begun(dock, span) => self.ports[usize::from(dock.index())].expect(span),
            Input::Frame(dock, flight) => self.receive(now, dock, &flight),
            Input::Crossed(mcu, message) => {
                self.inside.crossing[mcu as usize] -= 1;
                let delivered = self.deliver(now, mcu, message.message(), Source::Bridge);
                let counters = &mut self.inside.bridge;
                count(match delivered {
                    Ok(()) => &mut counters.messages_received,
                    Err(Undelivered::NoRoom) => &mut counters.no_buffer,
                    Err(Undelivered::Ignored | Undelivered::Refused) => &mut counters.ignored,
                });
            }
            Input::Taken(message) => {
                self.behaviours.take(now, &message, &mut output.doing);
                self.follow(output);
            }
            Input::Sent(message) => {
                // One that finds no room is lost.
                let _ = self.deliver(now, Mcu::Master, message.message(), Source::Task);
            }
        }
    }

    /// A frame is sent to a dock. Returns when the module first knows of it.
    pub fn arrive(&mut self, dock: Dock, flight: Flight) -> Option<u64> {
        if !self.is_on || flight.span.start < self.live_since[mcu_of(dock) as usize] {
            return None;
        }
        let begun_at = flight.span.start + CHARACTER;
        self.inside.insert(begun_at, Input::Begun(dock, flight.span.clone()));
        self.inside.insert(flight.taken_at(), Input::Frame(dock, flight));
        Some(begun_at)
    }

    /// What comes in at a dock is no frame.
    pub fn garbled(&mut self, dock: Dock) {
        self.port(dock).garbled();
    }

    fn receive(&mut self, now: u64, dock: Dock, flight: &Flight) {
        if is_deaf_while_it_sends(dock) && self.port(dock).has_drowned(&flight.span) {
            return self.garbled(dock);
        }
        self.touched.insert(dock);
        let ticks = self.behaviours.clock.ticks(now);
        let inside = &mut self.inside;
        let port = &mut self.ports[usize::from(dock.index())];
        port.receive(ticks, &flight.wire, |message| {
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
        let is_reset = |mcu: Mcu| is_reset(mcu, mcus);
        let live = (now + START_UP).max(self.powered_up_at) + START;
        for mcu in [Mcu::Master, Mcu::Slave].into_iter().filter(|mcu| is_reset(*mcu)) {
            self.live_since[mcu as usize] = live;
        }
        for (dock, port) in Dock::ALL.into_iter().zip(&mut self.ports) {
            if is_reset(mcu_of(dock)) {
                *port = Port::new(dock, self.random.next_u64() as u16, Clock { started_at: live });
                self.touched.insert(dock);
            }
        }
        if is_reset(Mcu::Master) {
            let told = self.behaviours.posture(now);
            self.behaviours = Behaviours::new(live, self.gait, self.random.next_u64() as u16);
            self.behaviours.told = told;
        }
        // What crosses the bridge is lost whichever end of it is reset.
        self.inside.crossing = [0; 2];
        self.inside.inputs.retain(|(_, input)| match input {
            Input::Begun(dock, _) | Input::Frame(dock, _) => !is_reset(mcu_of(*dock)),
            Input::Crossed(..) => false,
            Input::Taken(_) | Input::Sent(_) => !is_reset(Mcu::Master),
        });
    }

    fn port(&mut self, dock: Dock) -> &mut Port {
        self.touched.insert(dock);
        &mut self.ports[usize::from(dock.index())]
    }
}

/// Whether an MCU is one of these.
pub fn is_reset(mcu: Mcu, mcus: Mcus) -> bool {
    match mcus {
        Mcus::Both => true,
        Mcus::Master => mcu == Mcu::Master,
        Mcus::Slave => mcu == Mcu::Slave,
    }
}

/// The MCU that a dock is on.
pub fn mcu_of(dock: Dock) -> Mcu {
    if is_on_slave(dock) { Mcu::Slave } else { Mcu::Master }
}

impl Inside {
    /// Hands a message on as the router of this MCU says. Returns the dock that it leaves by, if it leaves.
    fn deliver(
        &mut self,
        now: u64,
        mcu: Mcu,
        message: Message,
        source: Source,
    ) -> Result<Option<Dock>, Undelivered> {
        let router = if mcu == Mcu::Master { MASTER } else { SLAVE };
        match router.route(message.to(), source) {
            Route::Task(_) => self.insert(now + WAKE, Input::Taken(Letter::of(message))),
            Route::Link(dock) => return Ok(Some(dock)),
            Route::Bridge => {
                let other = if mcu == Mcu::Master { Mcu::Slave } else { Mcu::Master };
                self.cross(now, other, message)?;
            }
            Route::Ignored => return Err(Undelivered::Ignored),
            Route::Refused => return Err(Undelivered::Refused),
        }
        Ok(None)
    }

    /// Sends a message over the bridge.
    fn cross(&mut self, now: u64, to: Mcu, message: Message) -> Result<(), Undelivered> {
        let crossing = &mut self.crossing[to as usize];
        if *crossing > ROOM {
            return Err(Undelivered::NoRoom);
        }
        *crossing += 1;
        self.bus_until = self.bus_until.max(now + CROSS_BEFORE) + transfer(message.payload().len());
        count(&mut self.bridge.messages_sent);
        self.insert(self.bus_until + CROSS_AFTER, Input::Crossed(to, Letter::of(message)));
        Ok(())
    }

    /// Puts an input in its place. Of those at the same time frames come first, by dock, then others as they
    /// were put in.
    fn insert(&mut self, at: u64, input: Input) {
        let place = self.inputs.partition_point(|other| (other.0, rank(&other.1)) > (at, rank(&input)));
        self.inputs.insert(place, (at, input));
    }
}

/// Counts one more.
fn count(counter: &mut u16) {
    *counter = counter.wrapping_add(1);
}

fn rank(input: &Input) -> u8 {
    match input {
        Input::Begun(dock, _) | Input::Frame(dock, _) => dock.index(),
        _ => u8::MAX,
    }
}
