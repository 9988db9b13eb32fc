//! A robot: its modules, and the attachments between their docks.

use std::collections::{BTreeMap, VecDeque};

use console::request::Topic;
use simulation::{
    Bodies, CHARACTER, Change, Environment, Face, JointOf, Links, MILLISECOND, Motion, Placing, Random,
    SHARED_LIGHT_LATENESS, START_UP, Terminal, Terrain, Transcript, Wiring, WiringError, fnv_1a, is_on_pins,
    lateness,
};
use tasks::dock::{Dock, DockSet};
use thiserror::Error;
use world::{Ground, Make, Trouble, WorldError};

use crate::Controller;
use crate::character::Character;
use crate::cpu::Reset;
use crate::link::{Channel, Faults, LinkCounts};
use crate::mcu::McuError;
use crate::module::{Images, Module};
use crate::physics::Physics;
use crate::terrain;
use crate::variation::{Variation, vary};

/// The longest window, in cycles. It holds while no transmitter is on.
pub(crate) const LONGEST_WINDOW: u64 = CHARACTER;

/// Modules and the attachments between their docks.
pub struct Robot {
    pub(crate) members: Vec<Member>,
    /// The world that the robot is in, if any.
    pub(crate) physics: Option<Physics>,
    wiring: Wiring,
    seed: u64,
    /// Channels made so far.
    channels: u64,
    /// The angle by which the robot is turned about its long axis, in degrees.
    roll: f64,
    /// Messages sent from outside so far.
    commands: u8,
    /// Cycles since power-up.
    pub(crate) now: u64,
}

/// A module, and the links that begin at its docks.
pub(crate) struct Member {
    pub module: Module,
    /// In the order of [`Dock::ALL`].
    ports: [Option<Port>; 6],
    /// The faults of what leaves by each dock, whatever is attached, in the order of [`Dock::ALL`].
    faults: [Faults; 6],
    /// Docks that hear their own characters, for something bright is before them.
    echoes: DockSet,
    /// Whether docks that hear another share its light, and hear their own characters, too.
    shares_light: bool,
    /// All terminals that were ever placed at its docks.
    terminals: Vec<Placed>,
    /// Markers of this run, in no particular order.
    pub events: Vec<Event>,
}

/// A marker that a program wrote.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Event {
    pub cycle: u64,
    /// The module's index.
    pub module: usize,
    pub controller: Controller,
    pub value: u8,
}

/// The dock at the other end of a link, and the way there.
struct Port {
    peer: Face,
    channel: Channel,
}

/// A character on its way between two modules.
pub(crate) struct Delivery {
    pub from: Face,
    pub to: Face,
    pub character: Character,
}

/// A robot to be built.
#[derive(Clone, Debug)]
pub struct RobotBuilder {
    images: Images,
    /// Modules that run other programs.
    others: BTreeMap<usize, Images>,
    modules: usize,
    attachments: Vec<(Face, Face)>,
    seed: u64,
    power_up_within: u64,
    ground: Option<Ground>,
    makes: Vec<Make>,
    variations: Vec<Variation>,
}

/// Why a robot cannot be built.
#[derive(Debug, Error)]
pub enum RobotError {
    #[error(transparent)]
    Wiring(#[from] WiringError),
    #[error(transparent)]
    Mcu(#[from] McuError),
    #[error(transparent)]
    World(#[from] WorldError),
}

impl RobotBuilder {
    /// A robot of `modules` modules, attached to nothing.
    pub fn new(images: Images, modules: usize) -> Self {
        Self {
            images,
            others: BTreeMap::new(),
            modules,
            attachments: Vec::new(),
            seed: 0,
            power_up_within: 0,
            ground: None,
            makes: vec![Make::default(); modules],
            variations: Vec::new(),
        }
    }

    /// A robot whose modules are attached as in `wiring`.
    pub fn wired(images: Images, wiring: &Wiring) -> Self {
        Self { attachments: wiring.attachments().collect(), ..Self::new(images, wiring.modules()) }
    }

    /// A chain: the Back of each module is attached to the Front of the next.
    pub fn chain(images: Images, modules: usize) -> Self {
        let link = |behind: usize| {
            let back = Face { module: behind - 1, dock: Dock::Back };
            (back, Face { module: behind, dock: Dock::Front })
        };
        let attachments = (1..modules).map(link).collect();
        Self { attachments, ..Self::new(images, modules) }
    }

    /// Gives one module other programs than the rest.
    #[must_use]
    pub fn program(mut self, module: usize, images: Images) -> Self {
        self.others.insert(module, images);
        self
    }

    /// Attaches two docks to each other.
    #[must_use]
    pub fn attach(mut self, one: Face, other: Face) -> Self {
        self.attachments.push((one, other));
        self
    }

    /// Sets the seed of all chance in the robot's run, such as memories at power-up and losses on links.
    #[must_use]
    pub fn seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// Powers the modules up at different times, drawn from the first `cycles` cycles.
    #[must_use]
    pub fn power_up_within(mut self, cycles: u64) -> Self {
        self.power_up_within = cycles;
        self
    }

    /// Puts the robot into a physical world. Without a world, each joint turns on its own, and nothing has
    /// weight.
    #[must_use]
    pub fn on(mut self, ground: Ground) -> Self {
        self.ground = Some(ground);
        self
    }

    /// Puts the robot into a physical world as a robot file describes it, with the loads of the modules.
    #[must_use]
    pub fn on_terrain(mut self, terrain: &Terrain) -> Self {
        self.makes = terrain::makes(terrain, self.modules);
        self.on(terrain::ground(terrain))
    }

    /// Varies what the world assumes of modules, drawn from the seed.
    #[must_use]
    pub fn varied(mut self, variations: &[Variation]) -> Self {
        self.variations = variations.into();
        self
    }

    /// Builds the robot, all MCUs at power-up.
    ///
    /// # Errors
    /// An attachment names a module that does not exist, or a dock twice; an image does not fit; or there is
    /// no world for such a robot, or on this ground.
    pub fn build(self) -> Result<Robot, RobotError> {
        let Self {
            images,
            others,
            modules,
            attachments,
            seed,
            power_up_within,
            ground,
            mut makes,
            variations,
        } = self;
        let member = |index| {
            let mut random = Random::of_part(seed, index as u64);
            let mut module = Module::new(others.get(&index).unwrap_or(&images), random.next_u64())?;
            module.power_up_at(random.next_u64().checked_rem(power_up_within).unwrap_or(0));
            for controller in Controller::ALL {
                module.mcu_mut(controller).set_start_up(START_UP);
            }
            let (ports, faults, terminals) = Default::default();
            let (echoes, shares_light) = (DockSet::EMPTY, false);
            Ok(Member { module, ports, faults, echoes, shares_light, terminals, events: Vec::new() })
        };
        let members = (0..modules).map(member).collect::<Result<_, McuError>>()?;
        let wiring = Wiring::new(modules);
        let mut robot =
            Robot { members, physics: None, wiring, seed, channels: 0, roll: 0.0, commands: 0, now: 0 };
        for (one, other) in attachments {
            robot.attach(one, other)?;
        }
        if let Some(ground) = ground {
            vary(&mut makes, &variations, seed);
            robot.enter(Physics::new(&robot.wiring, &ground, &makes)?);
        }
        Ok(robot)
    }
}

impl Robot {
    pub fn modules(&self) -> usize {
        self.members.len()
    }

    /// The module at `index`; `None` if there is none.
    pub fn module(&self, index: usize) -> Option<&Module> {
        self.members.get(index).map(|member| &member.module)
    }

    pub fn module_mut(&mut self, index: usize) -> Option<&mut Module> {
        self.members.get_mut(index).map(|member| &mut member.module)
    }

    /// The robot's wiring, which each module's own view has to equal.
    pub fn wiring(&self) -> &Wiring {
        &self.wiring
    }

    /// The dock to which a dock is attached; `None` if there is none.
    pub fn neighbour(&self, face: Face) -> Option<Face> {
        self.wiring.peer(face)
    }

    /// The robot's motion so far; `None` without a world.
    pub fn motion(&self) -> Option<Motion> {
        self.physics.as_ref().map(Physics::motion)
    }

    /// The middle of a module, in m; `None` without a world.
    pub fn place(&self, module: usize) -> Option<[f64; 3]> {
        Some(self.physics.as_ref()?.place(module))
    }

    /// The position of a module and the angles of its joints; `None` without a world.
    pub fn placing(&self, module: usize) -> Option<Placing> {
        Some(self.physics.as_ref()?.placing(module))
    }

    /// The most that a module with two legs leaned so far, in degrees; `None` without a world.
    pub fn tilt(&self) -> Option<f64> {
        self.physics.as_ref().map(Physics::tilt)
    }

    /// The charge that the module with the highest consumption has taken from its battery since power-up, as
    /// a fraction of a full charge.
    pub fn charge_used(&self) -> f64 {
        self.charges_used().fold(0.0, f64::max)
    }

    /// The charge that each module has taken from its battery since power-up, as a fraction of a full charge.
    pub fn charges_used(&self) -> impl Iterator<Item = f64> {
        self.members.iter().map(|member| member.module.body().battery.used())
    }

    /// The distance between the middles of two docks in mm; `None` without a world.
    pub fn distance(&self, one: Face, other: Face) -> Option<f64> {
        Some(self.physics.as_ref()?.distance(one, other))
    }

    /// Why the robot's world can't go on; `None` while it can.
    pub fn trouble(&self) -> Option<&Trouble> {
        self.physics.as_ref()?.trouble()
    }

    /// Puts the robot into a world, which moves the joints from now on.
    fn enter(&mut self, mut physics: Physics) {
        for (number, member) in self.members.iter_mut().enumerate() {
            physics.enter(number, member.module.body_mut());
            member.module.show_body();
        }
        self.physics = Some(physics);
    }

    /// Attaches two docks to each other.
    ///
    /// # Errors
    /// A module does not exist, or a dock is not free.
    pub fn attach(&mut self, one: Face, other: Face) -> Result<(), WiringError> {
        self.change(&Change::Attach(one, other))
    }

    /// Applies a change to the robot now. Characters that have left a dock already still arrive. Docks
    /// that are attached by it are latched, and docks that are detached are released.
    ///
    /// # Errors
    /// The change is not possible in the present wiring.
    pub fn change(&mut self, change: &Change) -> Result<(), WiringError> {
        let before = self.wiring.clone();
        change.apply(&mut self.wiring)?;
        if let Some(physics) = &mut self.physics {
            physics.change(change, &before, &self.wiring);
        }
        for face in before.faces() {
            if self.wiring.peer(face) != before.peer(face) {
                *self.port_mut(face) = None;
            }
        }
        let links: Vec<(Face, Face)> = self.wiring.links().collect();
        for (one, other) in links.into_iter().filter(|(one, other)| before.peer(*one) != Some(*other)) {
            self.join(one, other);
        }
        self.look_around();
        self.set_latches(&before);
        for (number, member) in self.members.iter_mut().enumerate() {
            member.echoes = self.wiring.obstacles(number);
            member.shares_light = self.wiring.shares_light();
        }
        match change {
            Change::Attach(..)
            | Change::Detach(_)
            | Change::Swap(..)
            | Change::Obstacle { .. }
            | Change::SharedLight(_)
            | Change::Push { .. } => {}
            &Change::Reset { module, mcus } => {
                for mcu in Controller::ALL.into_iter().filter(|mcu| mcus.contains(*mcu)) {
                    self.members[module].module.mcu_mut(mcu).reset(Reset::External);
                }
            }
            &Change::Kill(module) => self.members[module].module.power_down(),
            &Change::Loss { links, probability } => {
                self.for_links(links, |faults| faults.frame_loss = probability);
            }
            &Change::Noise { links, probability } => {
                self.for_links(links, |faults| faults.byte_noise = probability);
            }
            &Change::Roll(degrees) => {
                self.roll = degrees;
                self.feel();
            }
            &Change::Slip { module, degrees } => self.members[module].module.body_mut().slip(degrees),
            &Change::Fault { joint: JointOf { module, axis }, fault } => {
                self.members[module].module.body_mut().break_joint(axis, fault);
            }
            Change::Command { at, payload } => self.command(*at, payload),
            &Change::Console(Face { module, dock }) => {
                let member = &mut self.members[module];
                // A module without power yet hears nothing.
                let from = self.now.max(member.module.powered_up_at());
                member.terminals.push(Placed::new(dock, self.now, from));
            }
        }
        Ok(())
    }

    /// Without a world, shows all modules the accelerations that follow from how they lie now.
    pub(crate) fn feel(&mut self) {
        if self.physics.is_some() {
            return;
        }
        let angles = |module: usize| self.members[module].module.body().angles();
        let accelerations = self.wiring.accelerations(self.roll, angles);
        for (member, acceleration) in self.members.iter_mut().zip(accelerations) {
            member.module.body_mut().acceleration = acceleration;
        }
    }

    fn join(&mut self, one: Face, other: Face) {
        self.let_hear(one, other);
        self.let_hear(other, one);
    }

    /// From now on `peer` hears what a dock sends.
    fn let_hear(&mut self, from: Face, peer: Face) {
        // Counted down from the end, so that no channel draws from the sequence of a module's number.
        let random = Random::of_part(self.seed, u64::MAX - self.channels);
        self.channels += 1;
        let faults = self.members[from.module].faults[index(from.dock)].clone();
        let channel = Channel::new(faults, random);
        *self.port_mut(from) = Some(Port { peer, channel });
    }

    /// Lets free docks hear those that they see in the world by now.
    pub(crate) fn look_around(&mut self) {
        let Some(physics) = &self.physics else { return };
        let in_sight = physics.in_sight(&self.wiring);
        let free: Vec<Face> = self.wiring.docks().filter(|&face| self.wiring.peer(face).is_none()).collect();
        for from in free {
            let hearer = in_sight.get(&from).copied();
            if self.port_mut(from).as_ref().map(|port| port.peer) != hearer {
                *self.port_mut(from) = None;
                if let Some(hearer) = hearer {
                    self.let_hear(from, hearer);
                }
            }
        }
    }

    fn for_links(&mut self, links: Links, change: impl Fn(&mut Faults)) {
        for (number, member) in self.members.iter_mut().enumerate() {
            for ((dock, faults), port) in Dock::ALL.into_iter().zip(&mut member.faults).zip(&mut member.ports)
            {
                let from = Face { module: number, dock };
                if links == Links::All || links == Links::From(from) {
                    change(faults);
                    if let Some(port) = port {
                        change(&mut port.channel.faults);
                    }
                }
            }
        }
    }

    /// Sends a message to HORMONE in at a dock, as a neighbour would.
    fn command(&mut self, at: Face, payload: &[u8]) {
        self.commands = self.commands.wrapping_add(1);
        let module = &mut self.members[at.module].module;
        let bytes = simulation::command(at.dock, self.commands, payload);
        // A module that has no power yet is ahead, at the cycle of its power-up. What would begin before that
        // is lost.
        let powered_up_at = module.powered_up_at();
        let now = if powered_up_at > self.now { self.now } else { module.cycle() };
        let starts = simulation::SENDS.map(|later| now + later);
        for start in starts.into_iter().filter(|&start| start >= powered_up_at) {
            send(module, at.dock, start, &bytes);
        }
    }

    /// The texts that consoles have sent, in the order in which they were asked.
    pub fn transcripts(&self) -> Vec<Transcript> {
        let transcripts = self.members.iter().enumerate().flat_map(|(module, member)| {
            member.terminals.iter().map(move |&Placed { dock, at, ref terminal, .. }| Transcript {
                at,
                face: Face { module, dock },
                text: terminal.text().into(),
                is_complete: terminal.is_complete(),
            })
        });
        let mut transcripts: Vec<Transcript> = transcripts.collect();
        transcripts.sort_by_key(|transcript| transcript.at);
        transcripts
    }

    /// The counts of the link that begins at this dock; `None` if the dock is attached to nothing.
    pub fn link_counts(&self, from: Face) -> Option<LinkCounts> {
        self.port(from).map(|port| port.channel.counts())
    }

    /// Sets the faults of what leaves by this dock, whatever is attached there. Returns `false` if nothing
    /// is.
    pub fn set_faults(&mut self, from: Face, faults: Faults) -> bool {
        let is_attached = self.port(from).is_some();
        self.for_links(Links::From(from), |old| *old = faults.clone());
        is_attached
    }

    /// The MCUs whose programs have crashed, and why.
    pub fn crashes(&self) -> impl Iterator<Item = (usize, Controller, String)> {
        self.members.iter().enumerate().flat_map(|(module, member)| {
            Controller::ALL.into_iter().filter_map(move |controller| {
                let reason = member.module.mcu(controller).crash_reason()?;
                Some((module, controller, reason.to_owned()))
            })
        })
    }

    /// A hash of the state of all MCUs, and of the world.
    pub fn state_hash(&self) -> u64 {
        let hashes = self.members.iter().map(|member| member.module.state_hash());
        let hashes = hashes.chain(self.physics.as_ref().map(Physics::state_hash));
        fnv_1a(hashes.flat_map(u64::to_le_bytes))
    }

    fn port(&self, face: Face) -> Option<&Port> {
        self.members.get(face.module)?.ports[index(face.dock)].as_ref()
    }

    /// The module exists.
    fn port_mut(&mut self, face: Face) -> &mut Option<Port> {
        &mut self.members[face.module].ports[index(face.dock)]
    }
}

impl Member {
    /// The modules that may hear this one, which is module `number`.
    pub fn joined(&self, number: usize) -> Vec<usize> {
        let echo = (self.shares_light || self.echoes != DockSet::default()).then_some(number);
        self.ports.iter().flatten().map(|port| port.peer.module).chain(echo).collect()
    }

    /// How far the module may get ahead of those that it is joined to, in cycles: the shortest frame that its
    /// transmitters are set up for, or less.
    pub fn window(&self) -> u64 {
        let longest = if self.shares_light { SHARED_LIGHT_LATENESS } else { LONGEST_WINDOW };
        self.module.shortest_frame().map_or(longest, |frame| frame.min(longest))
    }

    /// Takes the characters that the module, number `number` of the robot, has sent, and delivers those that
    /// arrive anywhere.
    pub fn take_deliveries(&mut self, number: usize, mut deliver: impl FnMut(Delivery)) {
        if !self.module.has_sent() && self.terminals.is_empty() {
            return;
        }
        for (dock, port) in Dock::ALL.into_iter().zip(&mut self.ports) {
            let from = Face { module: number, dock };
            let sent = self.module.take_sent(dock);
            match self.terminals.iter_mut().rfind(|terminal| terminal.dock == dock) {
                Some(terminal) if port.is_none() => terminal.step(&mut self.module, &sent),
                Some(terminal) => terminal.rest(self.module.cycle()),
                None => {}
            }
            for sent in sent {
                if self.echoes.contains(dock) {
                    let character = sent.later(lateness(dock, dock, false));
                    deliver(Delivery { from, to: from, character });
                }
                let Some(port) = port else { continue };
                let sent = sent.later(lateness(dock, port.peer.dock, self.shares_light));
                // A port on pins is deaf while it sends.
                if self.shares_light && !is_on_pins(dock) {
                    deliver(Delivery { from, to: from, character: sent });
                }
                if let Some(value) = port.channel.carry(sent.value) {
                    deliver(Delivery { from, to: port.peer, character: Character { value, ..sent } });
                }
            }
        }
    }
}

/// A terminal at a module's dock. Its times follow from the characters and from its own polls, not from when
/// it is stepped: that depends on where runs stop.
struct Placed {
    dock: Dock,
    /// The cycle at which it was placed.
    at: u64,
    terminal: Terminal,
    /// The characters that the dock has sent, and that the terminal has not yet heard to their end.
    coming: VecDeque<Character>,
    /// The cycle of the next poll, in which the terminal may send by itself.
    looks_at: u64,
    /// The cycle at which all that it has sent so far has arrived.
    free_at: u64,
}

/// Cycles from the event that a terminal answers to the begin of its answer. A round takes two windows at
/// most, and some cycles to the end of an instruction, so no module has come to that begin yet.
const ANSWERS_AFTER: u64 = LONGEST_WINDOW * 5 / 2;

impl Placed {
    /// A terminal that is placed now, and begins to work at `from`.
    fn new(dock: Dock, now: u64, from: u64) -> Self {
        let terminal = Terminal::new(Topic::All, from / MILLISECOND);
        Self { dock, at: now, terminal, coming: VecDeque::new(), looks_at: from, free_at: from }
    }

    /// Runs the terminal up to the cycle that the module has come to. The module has `sent` these characters
    /// since the last call.
    fn step(&mut self, module: &mut Module, sent: &[Character]) {
        let now = module.cycle();
        self.coming.extend(sent);
        loop {
            let end = self.coming.front().map(|next| next.end).filter(|&end| end <= self.looks_at);
            let at = end.unwrap_or(self.looks_at);
            if at > now {
                return;
            }
            let heard = end.and_then(|_| self.coming.pop_front());
            if heard.is_none() {
                self.looks_at += LONGEST_WINDOW;
            }
            let answer = self.terminal.step(at / MILLISECOND, heard.map(|heard| heard.value));
            if !answer.is_empty() {
                self.free_at = send(module, self.dock, self.free_at.max(at + ANSWERS_AFTER), &answer);
            }
        }
    }

    /// Stays silent and deaf until `now`, because something is attached in its place.
    fn rest(&mut self, now: u64) {
        self.coming.clear();
        self.looks_at = self.looks_at.max(now);
    }
}

/// Delivers bytes through a dock from `start` on. Returns the cycle at which the last one ends.
fn send(module: &mut Module, dock: Dock, mut start: u64, bytes: &[u8]) -> u64 {
    for &value in bytes {
        let end = start + CHARACTER;
        module.receive(dock, Character { value, start, end });
        start = end;
    }
    start
}

fn index(dock: Dock) -> usize {
    usize::from(dock.index())
}
