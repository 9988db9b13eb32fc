//! The decisions of HORMONE, the hormone-inspired controller of the paper's Figure 5: which action to
//! perform and which hormone to propagate, from the topology, the sensors, the local timer and the received
//! hormone.

use core::num::{NonZeroU8, NonZeroU16};

use tasks::dock::{Dock, DockSet};

use crate::action::{Action, Posture};
use crate::case::{Case, Source};
use crate::data::Data;
use crate::election::Election;
use crate::event::Event;
use crate::gait::{GAITS, Gait, Leader};
use crate::hormone::Hormone;
use crate::module_type::ModuleType;
use crate::order::{Course, Helm, Order, What};
use crate::pace::Pace;
use crate::pacemaker::Pacemaker;
use crate::rule::{BACK, Rule, Send};
use crate::sense::{Sense, Senses};
use crate::status::Status;
use crate::topology::{Neighbours, connected, to_bytes};

const ALL_DOCKS: DockSet = DockSet::of(&Dock::ALL);

/// A hormone to send, and through which docks.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Outgoing {
    /// What to send.
    pub hormone: Hormone,
    /// The docks it leaves by; at least one.
    pub docks: DockSet,
}

/// What HORMONE has to do after an input.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
#[must_use]
pub struct Response {
    /// What happened.
    pub event: Option<Event>,
    /// The hormone to send, through docks that have a neighbour.
    pub send: Option<Outgoing>,
    /// The action to perform from now on, be it the one before; `None` to go on as before.
    pub action: Option<Action>,
}

/// An input that nothing comes of.
pub(crate) const NOTHING: Response = Response { event: None, send: None, action: None };

/// Which part of its action a module performs in the present beat.
#[derive(Clone, Copy)]
struct Part {
    /// Beats of the action before this one.
    before: u8,
    /// Beats of the whole action.
    of: u8,
}

/// The state of HORMONE.
///
/// A module whose type no rule covers keeps still. One of type [`ModuleType::Other`] besides passes a
/// hormone on, unchanged, to all its neighbours but the one it came from, so that a robot of an
/// unknown shape is not cut off behind it.
pub struct Controller {
    pacemaker: Pacemaker,
    acting: ModuleType,
    /// The docks that have a neighbour.
    connected: DockSet,
    /// Where the rhythm comes from.
    source: Option<Dock>,
    /// Of the last hormone that came.
    lifetime: Option<NonZeroU8>,
    /// What this module adds to the rhythm of what it sends.
    rhythm: u8,
    part: Part,
    /// Where the last rule that was followed stands in its table.
    last_rule: u8,
    senses: Senses,
    /// Whether there was a beat since the sensors were asked.
    is_beat: bool,
    election: Election,
    helm: Helm,
    status: Status,
}

impl Controller {
    /// A module at power-up, at `now`, that walks by `gait` until a hormone of another of the [`GAITS`]
    /// comes. `seed` should differ from module to module and from boot to boot.
    pub const fn new(gait: Gait, seed: u16, now: u16) -> Self {
        Controller {
            pacemaker: Pacemaker::new(gait, now),
            acting: ModuleType::Other,
            connected: DockSet::EMPTY,
            source: None,
            lifetime: None,
            rhythm: seed as u8,
            part: Part { before: 0, of: 1 },
            last_rule: 0,
            senses: Senses::NONE,
            is_beat: false,
            election: Election::new(seed, now),
            helm: Helm::new(),
            status: Status { gait: gait.name, ..Status::POWER_UP },
        }
    }

    /// The module's neighbours are now these. A module that changes its type rests until the rules of
    /// its new type speak.
    #[inline(never)]
    pub fn topology(&mut self, neighbours: &Neighbours, now: u16) -> Response {
        let module_type = ModuleType::of(neighbours);
        self.status.module_type = module_type;
        self.status.neighbours = to_bytes(neighbours);
        self.connected = connected(neighbours);
        self.status.topology_changes = self.status.topology_changes.wrapping_add(1);
        let response = self.become_type(ModuleType::acting(neighbours), now);
        if self.is_leader() || !self.source.is_some_and(|dock| self.connected.contains(dock)) {
            self.source = None;
            self.pacemaker.forget();
        }
        Response { event: Some(Event::TopologyChanged(module_type)), ..response }
    }

    /// The clock is to be looked at: after [`next_due`](Self::next_due), or at any other time. Call again
    /// until it is `None`. A caller late by a beat skips one and does not make up for it.
    #[inline(never)]
    pub fn timer(&mut self, now: u16) -> Option<Response> {
        self.helm.expire(now);
        if self.is_in_ring()
            && let Some(token) = self.election.round(now)
        {
            return Some(self.send(Hormone::Token(token), BACK));
        }
        if self.is_leader() {
            let data = self.pacemaker.lead(now)?;
            self.status.hormone = data as u8;
            let lifetime = self.election.ring().and_then(NonZeroU8::new);
            let response = self.act(Source::Timer, data, self.rhythm, lifetime);
            return Some(Response { event: Some(Event::HormoneGenerated(data)), ..response });
        }
        let data = self.pacemaker.make_good(now)?;
        if !self.pacemaker.is_following() {
            return Some(self.rest());
        }
        self.status.made_good = self.status.made_good.wrapping_add(1);
        let response = self.relay(data);
        Some(Response { event: Some(Event::MadeGood(data)), ..response })
    }

    /// Milliseconds from `now` until [`timer`](Self::timer) is to be called; `None` while nothing waits for
    /// it.
    pub fn next_due(&self, now: u16) -> Option<u16> {
        const NEVER: u16 = u16::MAX;
        let beat = if self.is_leader() {
            self.pacemaker.until_beat(now)
        } else {
            self.pacemaker.until_overdue(now).unwrap_or(NEVER)
        };
        let round = if self.is_in_ring() { self.election.next_due(now) } else { NEVER };
        let next = beat.min(round).min(self.helm.next_due(now).unwrap_or(NEVER));
        (next != NEVER).then_some(next)
    }

    /// `hormone` came in by `dock` at `now`.
    #[inline(never)]
    pub fn received(&mut self, dock: Dock, hormone: Hormone, now: u16) -> Response {
        self.status.hormones_received = self.status.hormones_received.wrapping_add(1);
        match hormone {
            Hormone::Pace(pace) => {
                let response = if self.takes_up(dock, pace, now) {
                    self.lifetime = pace.lifetime;
                    self.relay(pace.data)
                } else {
                    self.dropped()
                };
                Response { event: Some(Event::HormoneReceived(dock, pace.data)), ..response }
            }
            Hormone::Order(order) => self.order(Some(dock), order, now),
            Hormone::Token(token) if self.is_in_ring() => {
                let has_led = self.is_leader();
                let passed_on = self.election.hear(token, now);
                if self.is_leader() && !has_led {
                    // As in `become_type`, and in `topology`.
                    self.pacemaker.skip(now);
                    self.source = None;
                }
                passed_on.map_or(NOTHING, |token| self.send(Hormone::Token(token), BACK))
            }
            Hormone::Token(_) => self.dropped(),
        }
    }

    /// Somebody orders the robot about: the neighbour at `from`, or a task of this module.
    pub fn order(&mut self, from: Option<Dock>, order: Order, now: u16) -> Response {
        if !self.helm.hear(order, now) {
            return self.dropped();
        }
        let mut docks = ALL_DOCKS;
        if let Some(from) = from {
            docks.remove(from);
        }
        let response = match order.aged() {
            Some(order) => self.send(Hormone::Order(order), docks),
            None => NOTHING,
        };
        let What::Walk(name) = order.what else { return response };
        if name == self.gait().name {
            return response;
        }
        let Some(gait) = gait_named(name) else {
            // Others may know it.
            let _ = self.dropped();
            return response;
        };
        self.status.gait = gait.name;
        self.pacemaker = Pacemaker::new(gait, now);
        Response { send: response.send, ..self.rest() }
    }

    /// The senses whose sensors are to be asked now, for [`read`](Self::read): once a beat, those that are a
    /// condition of a rule for this type.
    pub fn asks(&mut self) -> impl Iterator<Item = Sense> {
        let is_beat = core::mem::take(&mut self.is_beat);
        if is_beat {
            self.senses.age();
        }
        Sense::ALL.into_iter().filter(move |&sense| is_beat && self.minds(sense))
    }

    /// Whether there is a rule for this type with this sense.
    fn minds(&self, sense: Sense) -> bool {
        let case = Case::new(self.acting, Source::Timer).given(Some(sense));
        self.gait().rules.iter().any(|rule| rule.case.is_like(case))
    }

    /// Whether there was a beat since the last call of [`asks`](Self::asks).
    pub fn is_beat(&self) -> bool {
        self.is_beat
    }

    /// The sensor of `sense` reads `value`.
    pub fn read(&mut self, sense: Sense, value: i16) {
        self.senses.read(sense, value);
    }

    /// The target of the joints at `now`, or `None` if they are to stay where they are.
    ///
    /// A right leg is a left one in a mirror: it rolls to the other side. A leg on the side that the robot
    /// turns to takes half the stride, and backward: half the stride ahead does not turn a robot that is
    /// longer than it is wide.
    pub fn posture(&self, now: u16) -> Option<Posture> {
        let (index, _) = self.progress(now)?;
        let posture = self.status.action.motion().get(index)?;
        let motor2 = match (self.acting, self.helm.course()) {
            (ModuleType::LeftLeg, Course::Left) | (ModuleType::RightLeg, Course::Right) => {
                (posture.motor2 / 2).wrapping_neg()
            }
            _ => posture.motor2,
        };
        let is_right = self.acting == ModuleType::RightLeg;
        let roll = if is_right { posture.roll.wrapping_neg() } else { posture.roll };
        Some(Posture { motor2, roll, ..posture })
    }

    /// Milliseconds from `now` until the action's next posture; `None` while it has no other.
    pub fn until_posture(&self, now: u16) -> Option<u16> {
        let (_, left) = self.progress(now)?;
        left
    }

    /// Which of its postures the action has come to at `now`, and how many milliseconds that lasts yet;
    /// `None` for the last.
    fn progress(&self, now: u16) -> Option<(usize, Option<u16>)> {
        let steps = self.status.action.motion().len();
        let last = steps.checked_sub(1)?;
        if last == 0 {
            return Some((0, None));
        }
        let (_, beat_at) = self.pacemaker.last();
        let beat = self.gait().beat.get();
        let step = beat.wrapping_mul(self.part.of.into()) / NonZeroU16::new(steps as u16)?;
        let mut elapsed = beat.wrapping_mul(self.part.before.into()).wrapping_add(now.wrapping_sub(beat_at));
        // A few subtractions take less than a division.
        for index in 0..last {
            if elapsed < step {
                return Some((index, Some(step - elapsed)));
            }
            elapsed -= step;
        }
        Some((last, None))
    }

    /// Where the robot is to go.
    pub fn course(&self) -> Course {
        self.helm.course()
    }

    /// Whether this module beats the time.
    pub fn is_leader(&self) -> bool {
        match self.gait().leader {
            Leader::Head => self.acting == ModuleType::Head,
            Leader::Elected => self.is_in_ring() && self.election.ring().is_some(),
        }
    }

    /// Whether this module may be one of a ring, by how it is attached and what it walks by.
    fn is_in_ring(&self) -> bool {
        self.gait().leader == Leader::Elected && self.acting == ModuleType::Spine
    }

    /// Counts a message to a behaviour that could not be read.
    pub fn malformed(&mut self) {
        self.status.malformed = self.status.malformed.wrapping_add(1);
    }

    /// Counts a hormone message handed to a link.
    pub fn sent(&mut self) {
        self.status.hormones_sent = self.status.hormones_sent.wrapping_add(1);
    }

    /// Counts a hormone message that found no room.
    pub fn unsent(&mut self) {
        self.status.hormones_unsent = self.status.hormones_unsent.wrapping_add(1);
    }

    /// The module as it can be seen from outside.
    pub fn status(&self) -> &Status {
        &self.status
    }

    fn become_type(&mut self, acting: ModuleType, now: u16) -> Response {
        if acting == self.acting {
            return NOTHING;
        }
        let has_led = self.is_leader();
        self.acting = acting;
        // Whoever is behind gets another beat than before, and shall not wait for the old one.
        self.rhythm = self.rhythm.wrapping_add(1);
        // Else a new leader would take up what the timer came by while it was none.
        self.pacemaker.skip(now);
        if !self.is_in_ring() {
            self.election.follow(now);
        }
        let rest = self.rest();
        match self.gait().once.filter(|once| has_led && once.becomes == acting) {
            Some(once) => self.order(None, self.helm.next(What::Walk(once.then as u8)), now),
            None => rest,
        }
    }

    fn gait(&self) -> &Gait {
        self.pacemaker.gait()
    }

    fn rest(&mut self) -> Response {
        self.status.action = Action::Rest;
        self.senses = Senses::NONE;
        Response { action: Some(Action::Rest), ..NOTHING }
    }

    /// Does what the rule for a received letter says, be it made good.
    fn relay(&mut self, data: Data) -> Response {
        let rhythm = self.pacemaker.rhythm().wrapping_add(self.rhythm);
        let is_made_good = self.pacemaker.is_made_good();
        let pace = Pace { name: self.gait().name, data, is_made_good, rhythm, lifetime: self.lifetime };
        match pace.aged() {
            Some(Pace { lifetime, .. }) => self.act(Source::Hormone, data, rhythm, lifetime),
            None => Response { send: None, ..self.act(Source::Hormone, data, rhythm, None) },
        }
    }

    #[inline(never)] // it stands here several times: flash
    fn dropped(&mut self) -> Response {
        self.status.dropped = self.status.dropped.wrapping_add(1);
        NOTHING
    }

    /// Whether a hormone is news: one of a gait that the module knows, and for a beat that has not been.
    fn takes_up(&mut self, dock: Dock, pace: Pace, now: u16) -> bool {
        if self.is_leader() {
            return false;
        }
        let same_way = self.source == Some(dock);
        let is_news = if pace.name == self.gait().name {
            (pace.data as u8) < self.gait().beats && self.pacemaker.hear(pace, same_way, now)
        } else {
            let gait = gait_named(pace.name).filter(|gait| (pace.data as u8) < gait.beats);
            gait.is_some_and(|gait| self.pacemaker.change(gait, pace, same_way, now))
        };
        if !is_news {
            return false;
        }
        self.status.gait = pace.name;
        self.status.hormone = pace.data as u8;
        self.source = Some(dock);
        self.election.follow(now);
        true
    }

    /// Does what the rule for this letter says. What it sends goes out with this rhythm and lifetime.
    fn act(&mut self, source: Source, data: Data, rhythm: u8, lifetime: Option<NonZeroU8>) -> Response {
        self.is_beat = true;
        let beats = self.gait().beats;
        let (action, send) = match self.rule(source, data) {
            Some(rule) => {
                self.status.action = rule.action;
                self.part = Part { before: data.since(rule.first, beats), of: rule.beats(beats) };
                (Some(rule.action), rule.sends(data, beats))
            }
            None => (None, self.passes_on(data)),
        };
        let response = match send {
            Some(Send { data, docks }) => {
                let is_made_good = source == Source::Hormone && self.pacemaker.is_made_good();
                let pace = Pace { name: self.gait().name, data, is_made_good, rhythm, lifetime };
                self.send(Hormone::Pace(pace), self.onwards(docks))
            }
            None => NOTHING,
        };
        Response { action, ..response }
    }

    /// Sends a hormone by those of `docks` that have a neighbour.
    #[inline(never)] // likewise
    fn send(&self, hormone: Hormone, docks: DockSet) -> Response {
        let docks = docks.intersection(self.connected);
        Response { send: (!docks.is_empty()).then_some(Outgoing { hormone, docks }), ..NOTHING }
    }

    /// The rule for this letter: one for what the module senses before the one for all. There is one at most
    /// for each, and mostly it stands beside the last one, so the search begins there.
    fn rule(&mut self, source: Source, data: Data) -> Option<Rule> {
        let Gait { rules, beats, .. } = *self.gait();
        let mut held = self.senses.held();
        loop {
            let sense = held.next();
            let case = Case::new(self.acting, source).given(sense);
            let mut place = self.last_rule.saturating_sub(1);
            for _ in 0..rules.len() {
                if usize::from(place) >= rules.len() {
                    place = 0;
                }
                let rule = rules.get(place.into())?;
                if rule.case == case && rule.covers(data, beats) {
                    self.last_rule = place;
                    return Some(rule);
                }
                place += 1;
            }
            sense?;
        }
    }

    /// What a module of no known type sends: the same, to all.
    fn passes_on(&self, data: Data) -> Option<Send> {
        (self.acting == ModuleType::Other).then_some(Send { data, docks: ALL_DOCKS })
    }

    /// Of these docks those by which the rhythm does not come: what went back would be taken for a beat of
    /// somebody else.
    fn onwards(&self, mut docks: DockSet) -> DockSet {
        if let Some(source) = self.source {
            docks.remove(source);
        }
        docks
    }
}

#[inline(never)] // likewise
fn gait_named(name: u8) -> Option<Gait> {
    GAITS.get(usize::from(name).checked_sub(1)?)
}

#[cfg(test)]
mod tests;
