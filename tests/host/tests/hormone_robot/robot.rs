//! A robot of the modules' own behaviours over links that delay and lose messages, and checks of a robot
//! against the gait's definition.

use std::collections::{BTreeMap, HashMap};

use hormone::action::{Action, Posture};
use hormone::behaviours::Behaviours;
use hormone::data::Data;
use hormone::event::Event;
use hormone::gait::{Gait, GaitName};
use hormone::hormone::Hormone;
use hormone::module;
use hormone::module_type::ModuleType;
use hormone::neighbours::Neighbours;
use hormone::order::{Course, Order};
use hormone::pace::Pace;
use hormone::time::until;
use tasks::dock::Dock::{self, Back, Front, Left, Right};
use tasks::link::backoff::LONGEST;
use tasks::link::port::RETRY_LIMIT;
use tasks::link::sender::ACK_TIMEOUT;
use tasks::message::{Address, Letter, Message, TaskCode};
use tasks::post_office::Undelivered;
use tasks::request::{Report, Request};
use tasks::sensor::Sensor;

/// How long a sensor takes to answer, in milliseconds.
const ANSWERS_AFTER: u32 = 4;

/// A dock of one of the robot's modules.
pub type Port = (usize, Dock);

/// SplitMix64: the same seed gives the same run.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Random(seed)
    }

    pub fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ (z >> 31)) % bound
    }
}

/// A hormone that a module received or generated.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Beat {
    pub at: u32,
    pub data: Data,
}

/// An action that began, or continued into another beat.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Act {
    pub at: u32,
    pub action: Action,
}

struct Module {
    behaviours: Behaviours,
    gait: Gait,
    is_dead: bool,
    /// When the module's behaviours are due.
    wake_at: u32,
    /// The module's clock is the robot's plus this: the modules were not switched on together.
    clock_offset: u16,
    generated: Vec<Beat>,
    received: Vec<Beat>,
    acts: Vec<Act>,
    /// The sensors that were asked, and when they answer.
    questions: Vec<(u32, Sensor)>,
}

/// The messages and events of a module's behaviours.
#[derive(Default)]
struct Here {
    sent: Vec<Letter>,
    events: Vec<Event>,
}

impl module::Module for Here {
    fn send(&mut self, message: Message) -> Result<(), Undelivered> {
        self.sent.push(Letter::of(message));
        Ok(())
    }

    fn trace(&mut self, event: Event) {
        self.events.push(event);
    }
}

fn letter(to: TaskCode, from: Address, payload: &[u8]) -> Letter {
    Letter::of(Message::new(Address::here(to), from, payload).expect("it is short"))
}

enum Content {
    Probe(u8),
    Hormone(Vec<u8>),
}

/// A segment of a centipede's body.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Segment {
    Spine,
    /// A branch with its two legs.
    Branch,
}

pub struct Robot {
    modules: Vec<Module>,
    wires: Vec<[Option<Port>; 6]>,
    /// Directions that carry nothing, by the port they leave from.
    pub blind: Vec<Port>,
    /// The messages under way, by the time of arrival and a running number.
    air: BTreeMap<(u32, u64), (Port, Port, Content)>,
    sent: u64,
    random: Random,
    /// A message takes 1 to this many milliseconds.
    pub longest_delay: u16,
    /// How many of a hundred frames are lost, each way.
    pub frame_loss: u64,
    /// The accelerometers' reading along z.
    pub up: i16,
    /// How many of a hundred answers of sensors are lost.
    pub answer_loss: u64,
    /// Until when a dock's link is busy with a hormone.
    busy_until: HashMap<Port, u32>,
    /// Milliseconds since the start.
    pub now: u32,
}

impl Robot {
    /// `count` modules, none attached, that walk by `gait`.
    pub fn new(gait: Gait, count: usize, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let module = |_| {
            let clock_offset = random.below(1 << 16) as u16;
            let phase = random.below(1_000) as u16;
            let seed = random.below(1 << 16) as u16;
            Module {
                behaviours: alone(gait, seed, clock_offset, phase),
                gait,
                is_dead: false,
                wake_at: 0,
                clock_offset,
                generated: Vec::new(),
                received: Vec::new(),
                acts: Vec::new(),
                questions: Vec::new(),
            }
        };
        Robot {
            modules: (0..count).map(module).collect(),
            wires: vec![[None; 6]; count],
            blind: Vec::new(),
            air: BTreeMap::new(),
            sent: 0,
            random,
            longest_delay: 1,
            frame_loss: 0,
            up: 1000,
            answer_loss: 0,
            busy_until: HashMap::new(),
            now: 0,
        }
    }

    /// A robot of a head, `body` in this order, and a tail. Indices are in the same order, each branch
    /// followed by its left and its right leg.
    pub fn with_body(gait: Gait, body: &[Segment], seed: u64) -> Self {
        let legs = 2 * body.iter().filter(|&&segment| segment == Segment::Branch).count();
        let count = 2 + body.len() + legs;
        let mut robot = Robot::new(gait, count, seed);
        let mut last = 0;
        let mut next = 1;
        for segment in body {
            robot.attach((last, Back), (next, Front));
            last = next;
            next += 1;
            if *segment == Segment::Branch {
                robot.attach((last, Left), (next, Back));
                robot.attach((last, Right), (next + 1, Back));
                next += 2;
            }
        }
        robot.attach((last, Back), (next, Front));
        robot
    }

    /// The intended types of [`with_body`](Self::with_body)'s modules.
    pub fn planned_types(body: &[Segment]) -> Vec<ModuleType> {
        let mut types = vec![ModuleType::Head];
        for segment in body {
            match segment {
                Segment::Spine => types.push(ModuleType::Spine),
                Segment::Branch => {
                    types.extend([ModuleType::Branch, ModuleType::LeftLeg, ModuleType::RightLeg]);
                }
            }
        }
        types.push(ModuleType::Tail);
        types
    }

    pub fn len(&self) -> usize {
        self.modules.len()
    }

    pub fn attach(&mut self, one: Port, other: Port) {
        assert!(self.wire(one).is_none() && self.wire(other).is_none(), "the dock is taken");
        *self.wire_mut(one) = Some(other);
        *self.wire_mut(other) = Some(one);
    }

    pub fn detach(&mut self, port: Port) {
        if let Some(other) = self.wire_mut(port).take() {
            *self.wire_mut(other) = None;
        }
    }

    /// Swaps the places of modules `one` and `other`.
    pub fn swap(&mut self, one: usize, other: usize) {
        let moved = |index: usize| match index {
            index if index == one => other,
            index if index == other => one,
            index => index,
        };
        self.wires.swap(one, other);
        for wire in self.wires.iter_mut().flatten().flatten() {
            wire.0 = moved(wire.0);
        }
    }

    /// Restarts `module`, as after a reset.
    pub fn reset(&mut self, module: usize) {
        let now = self.clock(module);
        let seed = self.random.below(1 << 16) as u16;
        let old = &mut self.modules[module];
        old.wake_at = self.now;
        old.behaviours = Behaviours::new(old.gait, seed, now);
        old.acts.push(Act { at: self.now, action: Action::Rest });
    }

    /// Silences `module`, which stays attached.
    pub fn kill(&mut self, module: usize) {
        self.modules[module].is_dead = true;
    }

    pub fn wire(&self, (module, dock): Port) -> Option<Port> {
        self.wires[module][usize::from(dock.index())]
    }

    fn wire_mut(&mut self, (module, dock): Port) -> &mut Option<Port> {
        &mut self.wires[module][usize::from(dock.index())]
    }

    /// The actual neighbours of `module`: attached, alive, and not behind a blind dock.
    pub fn wiring(&self, module: usize) -> Neighbours {
        Dock::ALL.map(|dock| {
            let here = (module, dock);
            let there = self.wire(here)?;
            let is_dead = [module, there.0].iter().any(|&module| self.modules[module].is_dead);
            let is_blind = [here, there].iter().any(|port| self.blind.contains(port));
            (!is_dead && !is_blind).then_some(there.1)
        })
    }

    /// The neighbours that `module` believes it has.
    pub fn neighbours(&self, module: usize) -> Neighbours {
        self.modules[module].behaviours.status().neighbours().unwrap()
    }

    /// The type that `module` believes it has.
    pub fn module_type(&self, module: usize) -> ModuleType {
        self.modules[module].behaviours.status().module_type
    }

    pub fn hormones_received(&self, module: usize) -> &[Beat] {
        &self.modules[module].received
    }

    pub fn generated(&self, module: usize) -> &[Beat] {
        &self.modules[module].generated
    }

    /// What `module` did, in order.
    pub fn acts(&self, module: usize) -> &[Act] {
        &self.modules[module].acts
    }

    /// The present targets of the joints of `module`.
    pub fn posture(&self, module: usize) -> Option<Posture> {
        self.modules[module].behaviours.controller().posture(self.clock(module))
    }

    /// A remote control at `module` gives the robot an order.
    pub fn order(&mut self, module: usize, order: Order) {
        let payload = Hormone::Order(order).to_payload();
        self.receive(module, letter(TaskCode::HORMONE, Address::here(TaskCode::CONSOLE), payload.as_slice()));
    }

    /// The gait that `module` walks by.
    pub fn gait(&self, module: usize) -> Option<GaitName> {
        GaitName::from_byte(self.modules[module].behaviours.status().gait)
    }

    /// The course that `module` holds.
    pub fn course(&self, module: usize) -> Course {
        self.modules[module].behaviours.controller().course()
    }

    /// How often the modules have noticed a change of their neighbours, in all.
    pub fn topology_changes(&self) -> u32 {
        self.modules.iter().map(|module| u32::from(module.behaviours.status().topology_changes)).sum()
    }

    /// For how many milliseconds of `from..to` two modules performed the same action.
    pub fn together(&self, one: usize, other: usize, from: u32, to: u32) -> u32 {
        let action_at = |module: usize, time: u32| {
            let acts = self.acts(module);
            acts[..acts.partition_point(|act| act.at <= time)].last().map(|act| act.action)
        };
        (from..to).filter(|&time| action_at(one, time) == action_at(other, time)).count() as u32
    }

    pub fn orders_under_way(&self) -> usize {
        let is_order = |content: &Content| match content {
            Content::Hormone(payload) => {
                matches!(Hormone::from_payload(payload), Some(Hormone::Order(_) | Hormone::Standing(..)))
            }
            Content::Probe(_) => false,
        };
        self.air.values().filter(|(_, _, content)| is_order(content)).count()
    }

    pub fn hormones_under_way(&self) -> usize {
        self.air.values().filter(|(_, _, content)| matches!(content, Content::Hormone(_))).count()
    }

    /// Whether every module's view of its neighbours equals the wiring.
    pub fn knows_itself(&self) -> bool {
        (0..self.len()).all(|module| {
            self.modules[module].is_dead
                || self.neighbours(module) == self.wiring(module)
                    && self.module_type(module) == ModuleType::of(&self.wiring(module))
        })
    }

    /// Runs for at most `limit` milliseconds until the robot knows itself. Returns how long it took.
    pub fn discover(&mut self, limit: u32) -> Option<u32> {
        let start = self.now;
        while !self.knows_itself() {
            if self.now - start >= limit {
                return None;
            }
            self.run(1);
        }
        Some(self.now - start)
    }

    /// Runs for this many milliseconds.
    pub fn run(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds {
            self.now += 1;
            while let Some(arrival) = self.air.first_entry()
                && arrival.key().0 <= self.now
            {
                let (from, to, content) = arrival.remove();
                if self.wire(from) == Some(to) && !self.blind.contains(&from) {
                    self.arrive(to, content);
                }
            }
            for module in 0..self.len() {
                if self.now >= self.modules[module].wake_at && !self.modules[module].is_dead {
                    self.step(module);
                }
            }
        }
    }

    /// `payload` reaches HORMONE of `to` as if its neighbour had sent it.
    pub fn inject(&mut self, to: Port, payload: &[u8]) {
        self.arrive(to, Content::Hormone(payload.to_vec()));
    }

    /// `byte` reaches AC_RECV of `to` as if a neighbour had sent it.
    pub fn inject_probe(&mut self, to: Port, byte: u8) {
        self.arrive(to, Content::Probe(byte));
    }

    /// Does what is due in module `index` by its own clock.
    fn step(&mut self, index: usize) {
        self.answer(index);
        let now = self.clock(index);
        let mut here = Here::default();
        let module = &mut self.modules[index];
        module.behaviours.poll(now, &mut here);
        let due = until(module.behaviours.poll_at(now), now);
        module.wake_at = self.now + u32::from(due.max(1));
        self.follow(index, here);
        if let Some(&(answers_at, _)) = self.modules[index].questions.first() {
            let wake_at = &mut self.modules[index].wake_at;
            *wake_at = (*wake_at).min(answers_at);
        }
    }

    /// The sensors of `index` answer the questions whose time has come.
    fn answer(&mut self, index: usize) {
        while let Some(&(at, sensor)) = self.modules[index].questions.first()
            && at <= self.now
        {
            self.modules[index].questions.remove(0);
            if self.answer_loss == 0 || self.random.below(100) >= self.answer_loss {
                let report = Report::Value(sensor, self.up).to_payload();
                let from = Address::here(Request::Read(sensor).task());
                self.receive(index, letter(TaskCode::HORMONE, from, &report));
            }
        }
    }

    fn arrive(&mut self, (index, dock): Port, content: Content) {
        if self.modules[index].is_dead {
            return;
        }
        let letter = |to, payload: &[u8]| letter(to, Address::beyond(dock, to), payload);
        match content {
            Content::Probe(byte) => self.receive(index, letter(TaskCode::AC_RECEIVE, &[byte])),
            Content::Hormone(payload) => {
                if let Some(Hormone::Pace(Pace { data, .. })) = Hormone::from_payload(&payload) {
                    self.modules[index].received.push(Beat { at: self.now, data });
                }
                self.receive(index, letter(TaskCode::HORMONE, &payload));
            }
        }
    }

    /// A behaviour of `index` takes a message.
    fn receive(&mut self, index: usize, letter: Letter) {
        let now = self.clock(index);
        let mut here = Here::default();
        let module = &mut self.modules[index];
        module.wake_at = self.now;
        module.behaviours.receive(now, letter, &mut here);
        self.follow(index, here);
    }

    /// Handles the events and messages of the behaviours of `index`.
    fn follow(&mut self, index: usize, here: Here) {
        let at = self.now;
        let module = &mut self.modules[index];
        for event in here.events {
            match event {
                Event::HormoneGenerated(data) => module.generated.push(Beat { at, data }),
                Event::ActionBegun(action) => module.acts.push(Act { at, action }),
                _ => {}
            }
        }
        for letter in here.sent {
            match (letter.to().dock(), letter.to().task()) {
                (Some(dock), TaskCode::HORMONE) => {
                    self.send((index, dock), Content::Hormone(letter.payload().to_vec()));
                }
                (Some(dock), _) => self.send((index, dock), Content::Probe(letter.payload()[0])),
                (None, TaskCode::HORMONE) => self.receive(index, letter),
                (None, _) => {
                    if let Some(Request::Read(sensor)) = Request::from_payload(letter.payload()) {
                        self.modules[index].questions.push((at + ANSWERS_AFTER, sensor));
                    }
                }
            }
        }
    }

    fn send(&mut self, from: Port, content: Content) {
        let Some(to) = self.wire(from) else { return };
        let delay = 1 + self.random.below(u64::from(self.longest_delay)) as u32;
        let arrival = match content {
            Content::Probe(_) => (!self.is_lost()).then_some(self.now),
            Content::Hormone(_) => self.arrival(from),
        };
        if let Some(arrival) = arrival {
            self.air.insert((arrival + delay, self.sent), (from, to, content));
            self.sent += 1;
        }
    }

    /// When the frame of a hormone sent now gets through, if it does. The frame is repeated until the ACK
    /// comes or the link gives up, as on the real link; meanwhile the next hormone waits.
    fn arrival(&mut self, from: Port) -> Option<u32> {
        let mut time = self.now.max(self.busy_until.get(&from).copied().unwrap_or_default());
        let mut arrival = None;
        for _ in 0..=RETRY_LIMIT {
            let is_through = !self.is_lost();
            if is_through {
                arrival = arrival.or(Some(time));
            }
            if is_through && !self.is_lost() {
                break;
            }
            // One try takes the frame, the time-out for the ACK, a probe that comes in, and the back-off.
            let back_off = self.random.below(u64::from(LONGEST) + 1);
            time += 2 + u32::from(ACK_TIMEOUT) + 2 + back_off as u32;
        }
        self.busy_until.insert(from, time);
        arrival
    }

    /// Whether a frame is lost.
    fn is_lost(&mut self) -> bool {
        self.frame_loss > 0 && self.random.below(100) < self.frame_loss
    }

    fn clock(&self, index: usize) -> u16 {
        (self.now as u16).wrapping_add(self.modules[index].clock_offset)
    }

    /// How often the centipede's gait was violated in the beats of `from..to`. By its definition, in each
    /// half Period every module but head and tail acts once, a leg swings and holds in turn, the two legs of
    /// a branch never do the same, and nothing else moves.
    pub fn gait_violations(&self, from: u32, to: u32) -> usize {
        self.of_type(ModuleType::Head)
            .map(|head| {
                let half_periods = self.beats_of(head, from, to);
                assert!(half_periods.len() >= 3, "too short to tell a gait");
                let body = self.attached_to(head).into_iter().filter(|&module| module != head);
                body.map(|module| self.violations_of(module, &half_periods)).sum::<usize>()
            })
            .sum()
    }

    /// The modules that are of this type by the wiring.
    pub fn of_type(&self, wanted: ModuleType) -> impl Iterator<Item = usize> {
        (0..self.len()).filter(move |&module| ModuleType::of(&self.wiring(module)) == wanted)
    }

    /// The time from each beat of a leader to its next one, within `from..to`.
    pub fn beats_of(&self, leader: usize, from: u32, to: u32) -> Vec<[u32; 2]> {
        let starts: Vec<u32> = self.generated(leader).iter().map(|beat| beat.at).collect();
        let beats = starts.windows(2).map(|pair| [pair[0], pair[1]]);
        beats.filter(|&[start, end]| start >= from && end <= to).collect()
    }

    fn violations_of(&self, module: usize, half_periods: &[[u32; 2]]) -> usize {
        let module_type = ModuleType::of(&self.wiring(module));
        let actions = self.actions(module, half_periods);
        let is_wrong = |action: &&Option<Action>| match module_type {
            ModuleType::LeftLeg | ModuleType::RightLeg => {
                !matches!(action, Some(Action::Swing | Action::Holding))
            }
            ModuleType::Tail => action.is_some(),
            _ => **action != Some(Action::Straight),
        };
        let wrong = actions.iter().filter(is_wrong).count();
        let Some(other_leg) = self.other_leg(module) else {
            return wrong;
        };
        let repeated = actions.windows(2).filter(|pair| pair[0] == pair[1]).count();
        let others = self.actions(other_leg, half_periods);
        let together = actions.iter().zip(&others).filter(|(one, other)| one == other).count();
        wrong + repeated + together
    }

    /// The action of `module` in each beat; `None` if it did not begin exactly one.
    pub fn actions(&self, module: usize, beats: &[[u32; 2]]) -> Vec<Option<Action>> {
        let in_beat = |&[start, end]: &[u32; 2]| {
            let mut acts = self.acts(module).iter().filter(|act| (start..end).contains(&act.at));
            match (acts.next(), acts.next()) {
                (Some(act), None) => Some(act.action),
                _ => None,
            }
        };
        beats.iter().map(in_beat).collect()
    }

    /// The leg on the other side of the branch, if `module` is a leg.
    pub fn other_leg(&self, module: usize) -> Option<usize> {
        let (branch, side) = self.wire((module, Back))?;
        let other_side = match side {
            Left => Right,
            Right => Left,
            _ => return None,
        };
        self.wire((branch, other_side)).map(|(leg, _)| leg)
    }

    /// All modules of the robot that `module` is part of.
    pub fn attached_to(&self, module: usize) -> Vec<usize> {
        let mut found = vec![module];
        let mut next = 0;
        while let Some(&module) = found.get(next) {
            next += 1;
            let neighbours =
                Dock::ALL.into_iter().filter(|dock| self.wiring(module)[usize::from(dock.index())].is_some());
            for (neighbour, _) in neighbours.filter_map(|dock| self.wire((module, dock))) {
                if !found.contains(&neighbour) {
                    found.push(neighbour);
                }
            }
        }
        found
    }
}

/// A module that was switched on `phase` milliseconds before its clock reads `now`, and has been alone since.
fn alone(gait: Gait, seed: u16, now: u16, phase: u16) -> Behaviours {
    let mut time = now.wrapping_sub(phase);
    let mut behaviours = Behaviours::new(gait, seed, time);
    while until(now, time) > 0 {
        behaviours.poll(time, &mut Here::default());
        time = behaviours.poll_at(time);
    }
    behaviours
}

/// The paper's 100 modules: head, tail, 24 branches with 48 legs, 26 spines; in a random order.
pub fn hundred_modules(seed: u64) -> Vec<Segment> {
    let mut body = [[Segment::Branch; 24].as_slice(), &[Segment::Spine; 26]].concat();
    let mut random = Random::new(seed);
    for last in (1..body.len()).rev() {
        body.swap(last, random.below(last as u64 + 1) as usize);
    }
    body
}
