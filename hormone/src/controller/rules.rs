//! Hormones: which are taken up, what the rule for one says, and what goes on to the neighbours.

use core::num::NonZeroU16;

use tasks::dock::{Dock, DockSet};

use super::{ALL_DOCKS, Controller, NOTHING, Outgoing, Part, Response, gait_named};
use crate::case::{Case, Source};
use crate::data::Data;
use crate::gait::Gait;
use crate::hormone::Hormone;
use crate::module_type::ModuleType;
use crate::pace::{Pace, RHYTHMS};
use crate::rule::{Rule, Send};

impl Controller {
    /// The rhythm of what this module sends while it follows the rhythm `followed`, or leads if that is
    /// `None`. After a change the two summands may add up to the rhythm sent before. Then this module's own
    /// summand grows; else the modules behind would wait for the old beat.
    pub(super) fn onward(&mut self, followed: Option<u8>) -> u8 {
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
    pub(super) fn relay(&mut self, data: Data) -> Response {
        let rhythm = self.onward(Some(self.pacemaker.rhythm()));
        let pace = self.pace(data, self.pacemaker.is_made_good(), rhythm, self.lifetime);
        match pace.aged() {
            Some(Pace { lifetime, .. }) => self.act(Source::Hormone, data, rhythm, lifetime),
            None => Response { send: None, ..self.act(Source::Hormone, data, rhythm, None) },
        }
    }

    /// Takes up a hormone if it is news: of a gait that the module knows, and for a beat that has not been.
    /// Returns whether it did.
    #[inline(never)] // as `hear_token`
    pub(super) fn takes_up(&mut self, dock: Dock, pace: Pace, now: u16) -> bool {
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
    pub(super) fn act(
        &mut self,
        source: Source,
        data: Data,
        rhythm: u8,
        lifetime: Option<NonZeroU16>,
    ) -> Response {
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
                self.sending(Hormone::Pace(pace), self.onwards(docks))
            }
            None => NOTHING,
        };
        Response { action, ..response }
    }

    /// Sends a hormone by those of `docks` that have a neighbour.
    #[inline(never)] // as `rest`
    pub(super) fn send(&self, hormone: Hormone, docks: DockSet) -> Response {
        self.sending(hormone, docks)
    }

    /// As [`send`](Self::send), without the cycles of a call.
    #[inline(always)]
    fn sending(&self, hormone: Hormone, docks: DockSet) -> Response {
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
