//! The decisions of HORMONE, the hormone-inspired controller of the paper's Figure 5: which action to
//! perform and which hormone to propagate, from the topology, the sensors, the local timer and the received
//! hormone.

use core::num::NonZeroU16;

use tasks::devices::memory::Record;
use tasks::dock::{Dock, DockSet};
use tasks::docking::latch;

use crate::action::{Action, Posture};
use crate::case::{Case, Source};
use crate::data::Data;
use crate::election::{Election, Token};
use crate::event::Event;
use crate::gait::{GAITS, Gait, Leader, Once};
use crate::hormone::Hormone;
use crate::module_type::ModuleType;
use crate::neighbours::{Neighbours, connected, differences, to_bytes};
use crate::order::{Course, Helm, Order, What};
use crate::pace::{Pace, RHYTHMS};
use crate::pacemaker::{Beats, Pacemaker};
use crate::period::Period;
use crate::rule::{BACK, Rule, Send};
use crate::sense::{Sense, Senses, between_readings};
use crate::standing::{Ledger, STOP, Standing};
use crate::status::Status;
use crate::time::{reached, until};

const ALL_DOCKS: DockSet = DockSet::of(&Dock::ALL);

/// A hormone to send, and through which docks.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Outgoing {
    /// The hormone to send.
    pub hormone: Hormone,
    /// The docks it leaves by; at least one.
    pub docks: DockSet,
}

/// HORMONE's response to an input.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
#[must_use]
pub struct Response {
    /// The event to trace.
    pub event: Option<Event>,
    /// The hormone to send, through docks that have a neighbour.
    pub send: Option<Outgoing>,
    /// The action to perform from now on, which may be the one before; `None` to go on as before.
    pub action: Option<Action>,
}

/// The response to an input that has no effect.
pub(crate) const NOTHING: Response = Response { event: None, send: None, action: None };

/// Which part of its action a module performs in the present beat.
#[derive(Clone, Copy)]
struct Part {
    /// Beats of the action before this one.
    before: u8,
    /// Beats of the whole action.
    of: u8,
}

/// How long a robot has to have a head until the ring counts as open, in milliseconds. This is longer than a
/// neighbour is away while it is reset, or than a dock is blind for a moment.
const OPEN_AFTER: u16 = 1_000;

/// After the order to become a ring, a token does not show for this long that the robot is one, in
/// milliseconds. The robot may still be a ring of which a latch is opening; half a second after the latch has
/// opened, the lost neighbour has been missed.
const CLOSED_AFTER: u16 = latch::LONGEST_MS + 500;

/// After so many beats without a hormone, the neighbour that they came by is told the standing order. A
/// single hormone may be late.
const DOUBTFUL: u8 = 2;

/// The state of HORMONE.
///
/// A module whose type no rule covers keeps still. One of type [`ModuleType::Other`] also passes a hormone
/// on, unchanged, to all its neighbours but the one it came from, so that a robot of an unknown shape is not
/// cut off behind it.
pub struct Controller {
    pacemaker: Pacemaker,
    acting: ModuleType,
    /// The docks that have a neighbour.
    connected: DockSet,
    /// The dock that the rhythm comes by.
    source: Option<Dock>,
    /// The lifetime of the last hormone that was taken up.
    lifetime: Option<NonZeroU16>,
    /// This module's own summand of the rhythm that it sends.
    rhythm: u8,
    /// The rhythm that it followed when it sent last, if it did not lead, and the one that it sent.
    followed: Option<u8>,
    sent: u8,
    part: Part,
    /// The index of the last rule that was followed, in its table.
    last_rule: u8,
    senses: Senses,
    /// Whether there was a beat since the sensors were asked.
    is_beat: bool,
    /// When the sensors are to be asked again in this beat.
    ask_again_at: Option<u16>,
    election: Election,
    helm: Helm,
    ledger: Ledger,
    /// When the robot counts as open if it still has a head then. Until then no token shows that it is a
    /// ring.
    reshaped_at: Option<u16>,
    status: Status,
}

impl Controller {
    /// A module at power-up, at `now`. It walks by `gait` until it learns of an order to walk otherwise or,
    /// where there was no order, until a hormone of another of the [`GAITS`] comes. `seed` should differ from
    /// module to module and from boot to boot.
    pub const fn new(gait: Gait, seed: u16, now: u16) -> Self {
        Controller {
            pacemaker: Pacemaker::new(gait, now),
            acting: ModuleType::Alone,
            connected: DockSet::EMPTY,
            source: None,
            lifetime: None,
            rhythm: seed as u8,
            followed: None,
            sent: seed as u8 % RHYTHMS,
            part: Part { before: 0, of: 1 },
            last_rule: 0,
            senses: Senses::NONE,
            is_beat: false,
            ask_again_at: None,
            election: Election::new(seed, now),
            helm: Helm::new(),
            ledger: Ledger::new(gait.name),
            reshaped_at: None,
            status: Status { gait: gait.name, ..Status::POWER_UP },
        }
    }

    /// Takes in the module's present neighbours. A module that changes its type rests until a rule of its new
    /// type applies.
    #[inline(never)]
    pub fn topology(&mut self, neighbours: &Neighbours, now: u16) -> Response {
        let module_type = ModuleType::of(neighbours);
        self.status.module_type = module_type;
        let bytes = to_bytes(neighbours);
        let others = differences(&self.status.neighbours, &bytes);
        self.status.neighbours = bytes;
        self.connected = connected(neighbours);
        self.ledger.tell(self.connected.intersection(others), now);
        self.status.topology_changes = self.status.topology_changes.wrapping_add(1);
        let mut response = self.become_type(ModuleType::acting(neighbours), now);
        let is_another = response.action.is_some();
        if is_another || self.is_leader() || !self.source.is_some_and(|dock| self.connected.contains(dock)) {
            if self.source.take().is_some() && !self.is_leader() {
                // As in `pass_on`: no beat may come any more.
                response.action = self.rest().action;
            }
            self.pacemaker.forget();
        }
        Response { event: Some(Event::TopologyChanged(module_type)), ..response }
    }

    /// Does what is due by the clock. Call it after [`next_due`](Self::next_due), or at any other time, and
    /// again until it returns `None`. A caller that is late by a beat skips that beat and does not make up
    /// for it.
    #[inline(never)]
    pub fn timer(&mut self, now: u16) -> Option<Response> {
        self.helm.expire(now);
        if let Some((docks, knows)) = self.ledger.due(self.connected, now) {
            self.helm.tell(docks);
            return Some(self.send(Hormone::Standing(self.ledger.standing(), knows), docks));
        }
        if let Some((order, docks)) = self.helm.due(now) {
            return Some(self.send(Hormone::Order(order), docks));
        }
        if !self.is_in_ring() {
            self.election.rest(now);
        } else if let Some(response) = self.round(now) {
            return Some(response);
        }
        if self.reshaped_at.is_some_and(|at| reached(at, now)) {
            self.reshaped_at = None;
            if !self.is_in_ring() {
                return Some(self.reshaped(now));
            }
        }
        if self.is_leader() {
            let data = self.pacemaker.lead(now)?;
            // A leader follows no neighbour. It may have followed one in another gait.
            self.source = None;
            self.status.hormone = data as u8;
            let lifetime = self.election.ring().and_then(NonZeroU16::new);
            let rhythm = self.onward(None);
            let response = self.act(Source::Timer, data, rhythm, lifetime);
            return Some(Response { event: Some(Event::HormoneGenerated(data)), ..response });
        }
        let data = self.pacemaker.make_good(now)?;
        if !self.pacemaker.is_following() {
            return Some(self.rest());
        }
        self.status.made_good = self.status.made_good.wrapping_add(1);
        if self.pacemaker.missed() == DOUBTFUL
            && let Some(dock) = self.source
        {
            // Another neighbour may be there by now, attached alike, that was ordered to stop.
            self.ledger.tell(DockSet::of(&[dock]), now);
        }
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
        let mut next = beat.min(round);
        if let Some(at) = self.reshaped_at {
            next = next.min(until(at, now));
        }
        if let Some(wait) = self.ledger.next_due(now) {
            next = next.min(wait);
        }
        if let Some(wait) = self.helm.next_due(now) {
            next = next.min(wait);
        }
        (next != NEVER).then_some(next)
    }

    /// The beats around now; `None` if none is awaited.
    pub fn beats(&self) -> Option<Beats> {
        let is_awaited = self.is_leader() || self.pacemaker.is_following();
        is_awaited.then(|| self.pacemaker.beats(self.connected))
    }

    /// Takes in `hormone`, which came by `dock` at `now`.
    #[inline(never)]
    pub fn received(&mut self, dock: Dock, hormone: Hormone, now: u16) -> Response {
        self.status.hormones_received = self.status.hormones_received.wrapping_add(1);
        match hormone {
            Hormone::Pace(pace) if self.takes_up(dock, pace, now) => {
                self.lifetime = pace.lifetime;
                let response = self.relay(pace.data);
                Response { event: Some(Event::HormoneReceived(dock, pace.data)), ..response }
            }
            Hormone::Pace(_) => Response { event: Some(Event::HormoneDropped(dock)), ..self.dropped() },
            Hormone::Order(order) => self.order(Some(dock), order, now),
            Hormone::Standing(standing, knows) => self.hear_of(standing, dock, knows, now),
            Hormone::Token(token) if self.is_in_ring() => self.hear_token(token, now),
            Hormone::Token(_) => self.dropped(),
        }
    }

    /// Sends the token of a round of the election, if one begins at `now`. A leader whose tokens did not come
    /// back stands down in it, and rests.
    fn round(&mut self, now: u16) -> Option<Response> {
        let has_led = self.election.ring().is_some();
        let token = self.election.round(now)?;
        let Response { send, .. } = self.send(Hormone::Token(token), BACK);
        let stands_down = has_led && self.election.ring().is_none();
        Some(Response { send, ..if stands_down { self.rest() } else { NOTHING } })
    }

    /// Passes a token on. `has_led` says that this module led before it came.
    #[inline(never)] // else its response takes stack beneath that of `reshaped`
    fn pass_on(&mut self, token: Token, has_led: bool) -> Response {
        let mut response = self.send(Hormone::Token(token), BACK);
        if has_led && !self.is_leader() {
            // No beat of the other module may come. The motion would begin again when the clock wraps.
            response.action = self.rest().action;
        }
        response
    }

    #[inline(never)] // keeps its stack frame out of the caller's
    fn hear_token(&mut self, token: Token, now: u16) -> Response {
        let has_led = self.is_leader();
        let is_own = self.election.is_own(token);
        let passed_on = self.election.hear(token, now);
        if let Some(token) = passed_on {
            return self.pass_on(token, has_led);
        }
        if is_own && self.once().is_some() && self.reshaped_at.is_none() {
            // The chain has closed.
            return self.reshaped(now);
        }
        if self.is_leader() && !has_led {
            // For the same reasons as in `become_type` and in `topology`.
            self.pacemaker.skip(now);
            self.pacemaker.forget();
            self.source = None;
        }
        NOTHING
    }

    /// Takes in the standing order that the neighbour at `dock` told. `knows` says that the neighbour knows
    /// that this module knows it.
    #[inline(never)] // as `hear_token`
    fn hear_of(&mut self, standing: Standing, dock: Dock, knows: bool, now: u16) -> Response {
        if !self.ledger.hear(dock, standing, knows, now) {
            return NOTHING;
        }
        let response = self.walk_by(standing, self.connected.without(DockSet::of(&[dock])), now);
        // The neighbour is to know that this module knows.
        self.ledger.hear(dock, standing, false, now);
        response
    }

    /// Takes in the order that was kept without power. It stands unless a neighbour has told a newer one.
    pub fn recall(&mut self, standing: Standing, now: u16) -> Response {
        if self.ledger.standing().number != 0 {
            return NOTHING;
        }
        let response = self.walk_by(standing, self.connected, now);
        self.ledger.kept();
        response
    }

    /// The order that is yet to be [kept](Self::kept) without power, if there is one.
    pub fn to_keep(&self) -> Option<Record> {
        self.ledger.to_keep()
    }

    /// The order has been kept.
    pub fn kept(&mut self) {
        self.ledger.kept();
    }

    /// Takes in an order from the dock `from`, or from a task of this module if that is `None`.
    pub fn order(&mut self, from: Option<Dock>, order: Order, now: u16) -> Response {
        match order.what {
            What::Walk(gait, period) => self.walk_from_now(gait, period, now),
            What::Steer(steer) => {
                if !self.helm.hear(steer, order.serial, now) {
                    return self.dropped();
                }
                let mut docks = ALL_DOCKS;
                if let Some(from) = from {
                    docks.remove(from);
                }
                match self.helm.onward(now) {
                    Some(order) => self.send(Hormone::Order(order), docks),
                    None => NOTHING,
                }
            }
        }
    }

    /// Orders the whole robot to walk by this gait.
    fn walk_from_now(&mut self, gait: u8, period: Period, now: u16) -> Response {
        match self.ledger.standing().next(gait, period) {
            Some(standing) => self.walk_by(standing, self.connected, now),
            None => NOTHING,
        }
    }

    /// Makes this the standing order, and has these neighbours told. A module that walks so already goes on;
    /// another one rests until its leader's beat comes.
    #[inline(never)] // as `hear_token`
    fn walk_by(&mut self, standing: Standing, tell: DockSet, now: u16) -> Response {
        let is_halted = self.is_halted();
        self.ledger.set(standing, tell, now);
        if self.is_halted() {
            if standing.gait != STOP {
                // Other modules may know the gait.
                let _ = self.dropped();
            }
            self.pacemaker.forget();
            self.reshaped_at = None;
            return self.rest();
        }
        let Some(gait) = gait_named(standing.gait) else { return NOTHING };
        let gait = standing.period.of(gait);
        if !is_halted && (gait.name, gait.beat) == (self.gait().name, self.gait().beat) {
            return NOTHING;
        }
        self.status.gait = gait.name;
        self.rhythm = self.rhythm.wrapping_add(1);
        self.pacemaker = Pacemaker::new(gait, now);
        self.reshaped_at = gait.once.map(|once| match once.becomes {
            ModuleType::Spine => now.wrapping_add(CLOSED_AFTER),
            _ => now.wrapping_add(OPEN_AFTER),
        });
        self.rest()
    }

    /// Whether the robot was ordered to stop, or to walk by a gait that this program does not have.
    pub fn is_halted(&self) -> bool {
        self.ledger.standing().gait.wrapping_sub(1) >= GAITS.len() as u8
    }

    /// The senses whose sensors are to be asked at `now`: those that are a condition of a rule for this type,
    /// eight times a beat. The answers go to [`read`](Self::read).
    pub fn asks(&mut self, now: u16) -> impl Iterator<Item = Sense> {
        let is_beat = core::mem::take(&mut self.is_beat);
        if is_beat {
            self.senses.beat();
        }
        let is_due = is_beat || self.next_ask(now) == Some(0);
        let asks = Sense::ALL.map(|sense| is_due && self.minds(sense));
        if is_due {
            let again_at = now.wrapping_add(between_readings(self.gait().beat));
            self.ask_again_at = asks.contains(&true).then_some(again_at);
        }
        Sense::ALL.into_iter().zip(asks).filter(|(_, asks)| *asks).map(|(sense, _)| sense)
    }

    /// Milliseconds from `now` until sensors are to be asked again; `None` while none is.
    pub fn next_ask(&self, now: u16) -> Option<u16> {
        self.ask_again_at.map(|at| until(at, now))
    }

    /// Whether a rule for this type has this sense as its condition.
    fn minds(&self, sense: Sense) -> bool {
        let case = Case::new(self.acting, Source::Timer).given(Some(sense));
        self.gait().rules.iter().any(|rule| rule.case.is_like(case))
    }

    /// Takes in `value`, a reading of the sensor of `sense`.
    pub fn read(&mut self, sense: Sense, value: i16) {
        self.senses.read(sense, value);
    }

    /// The target of the joints at `now`, or `None` if they are to stay where they are.
    ///
    /// A right leg mirrors a left one: it rolls to the other side. A leg on the side that the robot turns to
    /// takes half the stride, and backward: half the stride ahead does not turn a robot that is longer than
    /// it is wide. A module alone rolls to and fro to turn; a turn to the right mirrors one to the left.
    pub fn posture(&self, now: u16) -> Option<Posture> {
        let (index, _) = self.progress(now)?;
        let posture = self.status.action.motion().get(index)?;
        let motor2 = match (self.acting, self.helm.course()) {
            (ModuleType::LeftLeg, Course::Left) | (ModuleType::RightLeg, Course::Right) => {
                (posture.motor2 / 2).wrapping_neg()
            }
            _ => posture.motor2,
        };
        let roll = match (self.acting, self.helm.course()) {
            (ModuleType::RightLeg, _) | (ModuleType::Alone, Course::Right) => posture.roll.wrapping_neg(),
            (ModuleType::Alone, Course::Ahead) => 0,
            _ => posture.roll,
        };
        Some(Posture { motor2, roll, ..posture })
    }

    /// Milliseconds from `now` until the action's next posture; `None` while it has no other.
    pub fn until_posture(&self, now: u16) -> Option<u16> {
        let (_, left) = self.progress(now)?;
        left
    }

    /// The index of the action's posture at `now`, and the milliseconds for which it still lasts; `None` for
    /// the last.
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

    /// Whether this module leads: its timer generates the beats.
    pub fn is_leader(&self) -> bool {
        let leads = match self.gait().leader {
            Leader::Head => self.acting == ModuleType::Head,
            Leader::Alone => self.acting == ModuleType::Alone,
            Leader::Elected => self.is_in_ring() && self.election.ring().is_some(),
        };
        leads && !self.is_halted()
    }

    /// Whether this module may be part of a ring, judged by its type and its gait: a gait of rings, or one
    /// that ends in a ring.
    fn is_in_ring(&self) -> bool {
        self.acting == ModuleType::Spine && (self.gait().leader == Leader::Elected || self.once().is_some())
    }

    /// What the robot does once it has taken the shape in which this module has its present type. A robot
    /// that was ordered to stop does nothing.
    fn once(&self) -> Option<Once> {
        self.gait().once.filter(|once| once.becomes == self.acting && !self.is_halted())
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
        // The modules behind get another beat than before, and must not wait for the old one.
        self.rhythm = self.rhythm.wrapping_add(1);
        // Else a new leader would act on beats that passed while it did not lead.
        self.pacemaker.skip(now);
        if !self.is_in_ring() {
            self.election.leave(now);
        }
        if has_led && self.is_in_ring() {
            // No module leads any more, unless this one led for a moment only.
            self.election.stand(now);
        }
        if self.once().is_some() && !self.is_in_ring() {
            self.reshaped_at = Some(now.wrapping_add(OPEN_AFTER));
        }
        self.rest()
    }

    /// The robot has taken another shape.
    fn reshaped(&mut self, now: u16) -> Response {
        match self.once() {
            Some(once) => self.walk_from_now(once.then as u8, Period::OWN, now),
            None => NOTHING,
        }
    }

    fn gait(&self) -> &Gait {
        self.pacemaker.gait()
    }

    #[inline(never)] // called several times here: saves flash
    fn rest(&mut self) -> Response {
        self.status.action = Action::Rest;
        self.senses = Senses::NONE;
        self.is_beat = false;
        self.ask_again_at = None;
        Response { action: Some(Action::Rest), ..NOTHING }
    }

    /// The rhythm of what this module sends while it follows the rhythm `followed`, or leads if that is
    /// `None`. After a change the two summands may add up to the rhythm sent before. Then this module's own
    /// summand grows; else the modules behind would wait for the old beat.
    fn onward(&mut self, followed: Option<u8>) -> u8 {
        let mut rhythm = followed.unwrap_or(0).wrapping_add(self.rhythm) % RHYTHMS;
        if followed != self.followed {
            if rhythm == self.sent {
                self.rhythm = self.rhythm.wrapping_add(1);
                rhythm = (rhythm + 1) % RHYTHMS;
            }
            if self.followed.is_some()
                && let Some(dock) = self.source
            {
                // Another neighbour may be there by now, attached alike, that walks in another Period.
                let (_, beat_at) = self.pacemaker.last();
                self.ledger.tell(DockSet::of(&[dock]), beat_at);
            }
        }
        (self.followed, self.sent) = (followed, rhythm);
        rhythm
    }

    /// Does what the rule for a received letter says, also for a letter that was made good.
    fn relay(&mut self, data: Data) -> Response {
        let rhythm = self.onward(Some(self.pacemaker.rhythm()));
        let pace = self.pace(data, self.pacemaker.is_made_good(), rhythm, self.lifetime);
        match pace.aged() {
            Some(Pace { lifetime, .. }) => self.act(Source::Hormone, data, rhythm, lifetime),
            None => Response { send: None, ..self.act(Source::Hormone, data, rhythm, None) },
        }
    }

    #[inline(never)] // as `rest`
    fn dropped(&mut self) -> Response {
        self.status.dropped = self.status.dropped.wrapping_add(1);
        NOTHING
    }

    /// Takes up a hormone if it is news: of a gait that the module knows, and for a beat that has not been.
    /// Returns whether it did.
    #[inline(never)] // as `hear_token`
    fn takes_up(&mut self, dock: Dock, pace: Pace, now: u16) -> bool {
        if self.is_leader() {
            return false;
        }
        let standing = self.ledger.standing();
        if standing.number != 0 && pace.name != standing.gait {
            // The neighbour or this module does not know the newest order.
            self.ledger.tell(DockSet::of(&[dock]), now);
            return false;
        }
        let same_way = self.source == Some(dock);
        let is_news = if pace.name == self.gait().name {
            (pace.data as u8) < self.gait().beats && self.pacemaker.hear(pace, same_way, now)
        } else {
            let gait = gait_named(pace.name).filter(|gait| (pace.data as u8) < gait.beats);
            let changes = gait.is_some_and(|gait| self.pacemaker.change(gait, pace, same_way, now));
            if changes {
                // The new gait may have no rule for this module.
                let _ = self.rest();
            }
            changes
        };
        if !is_news {
            return false;
        }
        self.status.gait = pace.name;
        self.status.hormone = pace.data as u8;
        self.source = Some(dock);
        if !pace.is_made_good {
            self.election.follow(now);
        }
        true
    }

    /// The hormone of the last beat.
    fn pace(&self, data: Data, is_made_good: bool, rhythm: u8, lifetime: Option<NonZeroU16>) -> Pace {
        let number = self.pacemaker.number();
        Pace { name: self.gait().name, data, is_made_good, number, rhythm, lifetime }
    }

    /// Does what the rule for this letter says. The hormone that the rule sends gets this rhythm and
    /// lifetime.
    fn act(&mut self, source: Source, data: Data, rhythm: u8, lifetime: Option<NonZeroU16>) -> Response {
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
                let pace = self.pace(data, is_made_good, rhythm, lifetime);
                self.send(Hormone::Pace(pace), self.onwards(docks))
            }
            None => NOTHING,
        };
        Response { action, ..response }
    }

    /// Sends a hormone by those of `docks` that have a neighbour.
    #[inline(never)] // as `rest`
    fn send(&self, hormone: Hormone, docks: DockSet) -> Response {
        let docks = docks.intersection(self.connected);
        Response { send: (!docks.is_empty()).then_some(Outgoing { hormone, docks }), ..NOTHING }
    }

    /// The rule for this letter. A rule for what the module senses goes before the one without a condition.
    /// There is at most one for each case, and it mostly stands beside the last rule, so the search begins
    /// there.
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

    /// What a module of no known type sends: the same letter, to all neighbours.
    fn passes_on(&self, data: Data) -> Option<Send> {
        (self.acting == ModuleType::Other).then_some(Send { data, docks: ALL_DOCKS })
    }

    /// `docks` without the one that the rhythm comes by. The module there would take a hormone that went back
    /// for a beat of another leader.
    fn onwards(&self, mut docks: DockSet) -> DockSet {
        if let Some(source) = self.source {
            docks.remove(source);
        }
        docks
    }
}

#[inline(never)] // as `rest`
fn gait_named(name: u8) -> Option<Gait> {
    GAITS.get(usize::from(name).checked_sub(1)?)
}

#[cfg(test)]
mod tests;
