//! A robot without microcontrollers: the behaviours, the links' ARQ and the routers of the modules
//! themselves, natively and in virtual time.
//!
//! Code of the tasks that takes no time, or waits for a timer, is that of the MCUs. Around it stands a model
//! of what takes time: frames on the wire, transfers between the MCUs, and the programs in between
//! ([`time`]). No two tasks compete for a CPU, and there is no interrupt. In a [world](Native::within) joints
//! and docking motors are driven by the code that drives them on the MCUs.

mod behaviours;
pub(crate) mod devices;
mod docking;
mod eeprom;
mod embodied;
mod half;
mod inside;
mod module;
mod orientation;
mod port;
mod time;
mod world;

use std::collections::HashMap;
use std::hash::{Hash, Hasher};

use tasks::dock::Dock;
use tasks::message::{Address, Letter, Message, TaskCode};

use crate::change::{Change, Links};
use crate::command::{SENDS, label};
use crate::environment::Environment;
use crate::fault::JointOf;
use crate::hardware::MILLISECOND;
use crate::hardware::lateness;
use crate::hash::Fnv;
use crate::placing::Placing;
use crate::pose::Angles;
use crate::random::Random;
use crate::robot::Robot;
use crate::scenario::Event;
use crate::totals::{BridgeTotals, LinkTotals};
use crate::trace_event::TraceEvent;
use crate::wiring::{Face, Wiring, WiringError};
use docking::{Due, SOONEST};
use hormone::gait::{Gait, GaitName};
use hormone::status::Status;
use module::{Module, Output, mcu_of};
use orientation::SAMPLE_PERIOD;
use plants::motion::Motion;
use plants::trouble::Trouble;
use port::{Flight, Wire};
use time::LOOKAHEAD;

/// Modules of a tile: their memory fits a core's cache.
const TILE: usize = 250;

/// A robot that runs natively.
pub struct Native {
    modules: Vec<Module>,
    wiring: Wiring,
    /// By module and dock, the way from there.
    channels: Vec<[Channel; 6]>,
    /// Whether any link ever lost or changed something.
    has_faults: bool,
    /// By module, when it has something to do next.
    due: Vec<u64>,
    /// The greatest distance of the indices of neighbours.
    distance: usize,
    /// Modules that are run through several windows at once.
    tile: usize,
    now: u64,
    trace_events: Vec<TraceEvent>,
    /// The requests to docks that are not done yet, in no particular order.
    dockings: Vec<Due>,
    changes: Vec<Event>,
    /// How the robot lies, in degrees, and when modules next feel it.
    roll: f64,
    felt_at: u64,
    output: Output,
    commands: u8,
    world: Option<Box<dyn Environment>>,
    /// By each free dock that another free one hears, the nearest of these.
    in_sight: HashMap<Face, Face>,
}

/// One direction of a link.
#[derive(Clone)]
struct Channel {
    loss: f64,
    noise: f64,
    random: Random,
}

impl Native {
    /// A robot at power-up. Chance follows from `seed`; modules get their power within so many cycles.
    pub fn new(wiring: Wiring, seed: u64, power_up_within: u64) -> Self {
        Self::with_gait(wiring, seed, power_up_within, GaitName::Centipede.gait())
    }

    /// As [`new`](Self::new), but modules begin with this gait, whatever the table under its name has.
    pub fn with_gait(wiring: Wiring, seed: u64, power_up_within: u64, gait: Gait) -> Self {
        let count = wiring.modules();
        let module = |index: usize| {
            let mut random = Random::of_part(seed, index as u64);
            let own = Random::new(random.next_u64());
            let power_up = random.next_u64().checked_rem(power_up_within).unwrap_or(0);
            Module::new(power_up, gait, own)
        };
        let channel = |module: usize, dock: Dock| {
            let part = u64::MAX - (module as u64 * 6 + u64::from(dock.index()));
            Channel { loss: 0.0, noise: 0.0, random: Random::of_part(seed, part) }
        };
        let mut robot = Native {
            modules: (0..count).map(module).collect(),
            wiring,
            channels: (0..count).map(|module| Dock::ALL.map(|dock| channel(module, dock))).collect(),
            has_faults: false,
            due: vec![0; count],
            distance: 0,
            tile: TILE,
            now: 0,
            trace_events: Vec::new(),
            dockings: Vec::new(),
            changes: Vec::new(),
            roll: 0.0,
            felt_at: 0,
            output: Output::default(),
            commands: 0,
            world: None,
            in_sight: HashMap::new(),
        };
        robot.measure();
        robot
    }

    /// Modules that are run through several windows at once. It changes the speed only.
    pub fn set_tile(&mut self, modules: usize) {
        self.tile = modules.max(1);
    }

    /// Measures how far apart the indices are of modules that hear each other.
    fn measure(&mut self) {
        let hearing = self.wiring.links().chain(self.in_sight.iter().map(|(&from, &to)| (from, to)));
        let distances = hearing.map(|(one, other)| one.module.abs_diff(other.module));
        self.distance = distances.max().unwrap_or(0);
    }

    /// Runs all modules up to `end`.
    ///
    /// In a window modules do not depend on each other. They need not all be run through one window before
    /// the next: a module may be in a later window than those of higher index, as long as its neighbours are
    /// through the one before. So tiles of modules are run through all windows one after the other, each tile
    /// shifted down by the greatest distance of neighbours from window to window, and a module's memory is in
    /// the cache for as long as it is in the tile.
    fn run_tiles(&mut self, end: u64) {
        let count = self.modules.len();
        let windows = self.now / LOOKAHEAD..end.div_ceil(LOOKAHEAD);
        let reach = (windows.end - windows.start) as usize * self.distance;
        // Where neighbours lie far apart all modules are one tile.
        let size = if self.distance < self.tile { self.tile } else { count + reach };
        for tile in (0..count + reach).step_by(size) {
            for (passed, window) in windows.clone().enumerate() {
                let shifted = |edge: usize| edge.saturating_sub(passed * self.distance).min(count);
                let end = end.min((window + 1) * LOOKAHEAD);
                for index in shifted(tile)..shifted(tile + size) {
                    if self.due[index] < end {
                        self.run_module(index, self.now.max(window * LOOKAHEAD), end);
                    }
                }
            }
        }
    }

    /// Lets a module do what is due from `start` to `end`.
    fn run_module(&mut self, index: usize, start: u64, end: u64) {
        let mut output = std::mem::take(&mut self.output);
        self.due[index] = self.modules[index].run(start, end, &mut output);
        let trace_event = |(cycle, event)| TraceEvent { cycle, module: index, event };
        self.trace_events.extend(output.events.drain(..).map(trace_event));
        self.dockings.extend(output.dockings.drain(..).map(|(at, docking)| Due::new(index, docking, at)));
        for (dock, flight) in output.flights.drain(..) {
            self.fly(Face { module: index, dock }, flight);
        }
        self.output = output;
    }

    /// A frame leaves by a dock.
    fn fly(&mut self, from: Face, flight: Flight) {
        if self.wiring.obstacles(from.module).contains(from.dock) {
            self.arrive(from, flight.clone().later(lateness(from.dock, from.dock, false)));
        }
        let in_sight = || self.in_sight.get(&from).copied();
        let Some(to) = self.wiring.peer(from).or_else(in_sight) else { return };
        if self.has_faults {
            let channel = &mut self.channels[from.module][usize::from(from.dock.index())];
            if channel.random.chance(channel.loss) {
                return;
            }
            // The CRC shows that the frame is changed.
            if (0..flight.wire.bytes()).any(|_| channel.random.chance(channel.noise)) {
                return self.modules[to.module].garbled(to.dock);
            }
        }
        let shares_light = self.wiring.shares_light();
        let shared = shares_light.then(|| flight.span.clone());
        let late = lateness(from.dock, to.dock, shares_light);
        self.arrive(to, Flight { shared, ..flight.later(late) });
    }

    fn arrive(&mut self, at: Face, flight: Flight) {
        if let Some(begun_at) = self.modules[at.module].arrive(at.dock, flight) {
            self.due[at.module] = self.due[at.module].min(begun_at);
        }
    }

    fn for_links(&mut self, links: Links, change: impl Fn(&mut Channel)) {
        self.has_faults = true;
        match links {
            Links::All => self.channels.iter_mut().flatten().for_each(change),
            Links::From(Face { module, dock }) => {
                change(&mut self.channels[module][usize::from(dock.index())]);
            }
        }
    }

    /// Lets a message to HORMONE come in at a dock, as from a neighbour.
    fn command(&mut self, at: Face, payload: &[u8]) {
        self.commands = self.commands.wrapping_add(1);
        let label = label(at.dock, self.commands);
        let address = Address::here(TaskCode::HORMONE);
        if let Ok(message) = Message::new(address, address, payload) {
            for start in SENDS.map(|later| self.now + later) {
                let wire = Wire::Data(label, Letter::of(message));
                let span = start..start + time::frame(payload.len());
                self.arrive(at, Flight { wire, span, shared: None });
            }
        }
    }
}

impl Robot for Native {
    fn wiring(&self) -> &Wiring {
        &self.wiring
    }

    fn now(&self) -> u64 {
        self.now
    }

    fn powered_up_at(&self, module: usize) -> u64 {
        self.modules[module].powered_up_at
    }

    fn start(&self) -> u64 {
        time::START
    }

    fn is_on(&self, module: usize) -> bool {
        self.modules[module].is_on
    }

    fn change(&mut self, change: &Change) -> Result<(), WiringError> {
        let before = self.world.as_ref().map(|_| self.wiring.clone());
        change.apply(&mut self.wiring)?;
        self.measure();
        if let Some(before) = before {
            self.change_world(change, &before);
        }
        match change {
            Change::Attach(..)
            | Change::Detach(_)
            | Change::Swap(..)
            | Change::Obstacle { .. }
            | Change::SharedLight(_) => {}
            &Change::Reset { module, mcus } => {
                self.dockings.retain(|due| due.module != module || !mcus.contains(mcu_of(due.dock())));
                self.modules[module].reset(self.now, mcus);
                self.due[module] = self.now;
            }
            &Change::Kill(module) => {
                self.dockings.retain(|due| due.module != module);
                self.modules[module].is_on = false;
                self.due[module] = u64::MAX;
            }
            &Change::Loss { links, probability } => {
                self.for_links(links, |channel| channel.loss = probability);
            }
            &Change::Noise { links, probability } => {
                self.for_links(links, |channel| channel.noise = probability);
            }
            &Change::Roll(degrees) => {
                self.roll = degrees;
                self.feel();
            }
            Change::Command { at, payload } => self.command(*at, payload),
            &Change::Slip { module, degrees } => {
                // Without a body joints are where they are told to be.
                if let Some(embodied) = self.modules[module].embodied_mut() {
                    embodied.body.slip(degrees);
                }
            }
            &Change::Fault { joint: JointOf { module, axis }, fault } => {
                if let Some(embodied) = self.modules[module].embodied_mut() {
                    embodied.body.break_joint(axis, fault);
                }
            }
            Change::Push { .. } => {} // without a world nothing has a weight
            Change::Console(_) => {}  // natively there are no stacks to tell of, so no console answers
        }
        Ok(())
    }

    fn run_until(&mut self, cycle: u64) {
        while self.now < cycle && self.trouble().is_none() {
            self.meet_world();
            // Requests to docks that are made from now on are due no sooner than `SOONEST` later.
            let due = self.dockings.iter().map(|due| due.at).min().unwrap_or(u64::MAX);
            if self.felt_at <= self.now {
                self.felt_at = self.now + SAMPLE_PERIOD;
                self.feel();
            }
            let mut end = cycle.min(due).min(self.now + SOONEST).min(self.felt_at);
            if self.world.is_some() {
                end = end.min((self.now + 1).next_multiple_of(MILLISECOND));
            }
            self.run_tiles(end);
            self.now = end;
            self.do_due();
        }
    }

    fn take_trace_events(&mut self) -> Vec<TraceEvent> {
        self.trace_events.sort_by_key(|trace_event| (trace_event.cycle, trace_event.module));
        // Events of what a module has begun to do may lie later.
        let past = self.trace_events.partition_point(|trace_event| trace_event.cycle < self.now);
        let later = self.trace_events.split_off(past);
        std::mem::replace(&mut self.trace_events, later)
    }

    fn take_changes(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.changes)
    }

    fn status(&self, module: usize) -> Option<Status> {
        self.modules.get(module)?.status(self.now)
    }

    fn acceleration(&self, module: usize) -> [f64; 3] {
        self.modules[module].acceleration
    }

    fn angles(&self, module: usize) -> Angles {
        self.modules[module].angles()
    }

    fn links(&self) -> LinkTotals {
        let mut totals = LinkTotals::default();
        self.modules.iter().flat_map(Module::links).for_each(|counters| totals.add(&counters));
        totals
    }

    fn bridges(&self) -> BridgeTotals {
        let mut totals = BridgeTotals::default();
        self.modules.iter().for_each(|module| totals.add(module.bridge()));
        totals
    }

    fn placing(&self, module: usize) -> Option<Placing> {
        Some(self.world.as_ref()?.placing(module))
    }

    fn motion(&self) -> Option<Motion> {
        Some(self.world.as_ref()?.motion())
    }

    fn tilt(&self) -> Option<f64> {
        Some(self.world.as_ref()?.tilt())
    }

    fn charge_used(&self) -> Option<f64> {
        let used = self.modules.iter().filter_map(|module| Some(module.embodied()?.body.battery.used()));
        used.reduce(f64::max)
    }

    fn trouble(&self) -> Option<&Trouble> {
        self.world.as_ref()?.trouble()
    }

    fn state_hash(&self) -> u64 {
        let mut hasher = Fnv::default();
        self.now.hash(&mut hasher);
        self.world.iter().for_each(|world| world.state_hash().hash(&mut hasher));
        self.modules.iter().for_each(|module| module.hash(&mut hasher));
        hasher.finish()
    }
}
