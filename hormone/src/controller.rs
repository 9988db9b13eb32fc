//! The decisions of HORMONE, the hormone-inspired controller of the paper's Figure 5: which action to
//! perform and which hormone to propagate, from the topology, the sensors, the local timer and the received
//! hormone.

mod orders;
mod posture;
mod ring;
mod rules;
mod senses;

use core::num::NonZeroU16;

use tasks::dock::{Dock, DockSet};

use crate::action::Action;
use crate::case::Source;
use crate::election::Election;
use crate::event::Event;
use crate::gait::{GAITS, Gait, Leader};
use crate::hormone::Hormone;
use crate::module_type::ModuleType;
use crate::neighbours::{Neighbours, connected, differences, to_bytes};
use crate::order::Helm;
use crate::pace::RHYTHMS;
use crate::pacemaker::{Beats, Pacemaker};
use crate::sense::{Sense, Senses};
use crate::standing::Ledger;
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

/// No sense matters.
const NONE_MINDED: [bool; Sense::ALL.len()] = [false; Sense::ALL.len()];

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
    /// The senses that matter in this beat, by their codes, and when their sensors are to be asked again.
    minded: [bool; Sense::ALL.len()],
    ask_again_at: u16,
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
            minded: NONE_MINDED,
            ask_again_at: now,
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

    /// Whether this module leads: its timer generates the beats.
    pub fn is_leader(&self) -> bool {
        let leads = match self.gait().leader {
            Leader::Head => self.acting == ModuleType::Head,
            Leader::Alone => self.acting == ModuleType::Alone,
            Leader::Elected => self.is_in_ring() && self.election.ring().is_some(),
        };
        leads && !self.is_halted()
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

    fn gait(&self) -> &Gait {
        self.pacemaker.gait()
    }

    #[inline(never)] // called several times here: saves flash
    fn rest(&mut self) -> Response {
        self.status.action = Action::Rest;
        self.senses = Senses::NONE;
        self.is_beat = false;
        self.minded = NONE_MINDED;
        Response { action: Some(Action::Rest), ..NOTHING }
    }

    #[inline(never)] // as `rest`
    fn dropped(&mut self) -> Response {
        self.status.dropped = self.status.dropped.wrapping_add(1);
        NOTHING
    }
}

#[inline(never)] // as `rest`
fn gait_named(name: u8) -> Option<Gait> {
    GAITS.get(usize::from(name).checked_sub(1)?)
}

#[cfg(test)]
mod tests;
