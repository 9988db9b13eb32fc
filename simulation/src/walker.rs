//! One module, judged by the rules of its type: the letters that it takes up, in turn, and what it does and
//! sends at each.

use std::collections::VecDeque;
use std::mem::replace;

use hormone::action::Action;
use hormone::case::{Case, Source};
use hormone::data::Data;
use hormone::gait::{Gait, Leader};
use hormone::module_type::ModuleType;
use hormone::neighbours::{Neighbours, connected};
use hormone::pacemaker::{MOST_MISSED, SILENT};
use hormone::rule::Rule;
use hormone::sense::Sense;
use tasks::dock::{Dock, DockSet};
use thiserror::Error;

use crate::hardware::MILLISECOND;

/// How long modules may take to notice a change: that a neighbour is gone is the slowest.
pub const DISCOVERY: u64 = 300 * MILLISECOND;

/// How long a hormone may take from a module to the next.
pub const HOP: u64 = 5 * MILLISECOND;

/// How long it may take until there is a leader: a ring has to elect one.
pub fn election(leader: Leader) -> u64 {
    if leader == Leader::Elected { 5_000 * MILLISECOND } else { 0 }
}

/// How long it may take, by this gait, until a module follows hormones that come another way than before: the
/// module before it makes good the beats of a leader that is gone, and then some are silent. Until then those
/// behind have no choice, so modules choose in turn.
pub fn choice(gait: &Gait) -> u64 {
    (u64::from(MOST_MISSED) + u64::from(SILENT)) * beat(gait)
}

fn beat(gait: &Gait) -> u64 {
    u64::from(gait.beat.get()) * MILLISECOND
}

/// Changes that come before a module is right again give it more time: in all, so many times the longest that
/// one of them gives.
const MOST_PATIENCE: u64 = 3;

/// A reading less than this beyond the bounds of a sense may be noise.
const MARGIN: i32 = 150;

/// A letter that was taken up, and what was done then.
#[derive(Clone, Copy)]
pub struct Step {
    source: Source,
    pub data: Data,
    /// When the letter was taken up.
    pub at: u64,
    /// By which docks hormones left then.
    sent: DockSet,
    /// When the module began to act, and how.
    pub acted: Option<(u64, Action)>,
}

/// What a module has to sense, by what its sensor reads.
#[derive(Clone, Copy)]
struct Sensed {
    sense: Sense,
    /// `None` between the bounds.
    holds: Option<bool>,
    since: u64,
}

/// A fault of a module, and when it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Violation {
    /// In cycles since power-up.
    pub at: u64,
    pub module: usize,
    pub wrong: Wrong,
}

/// A fault that a module can have.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum Wrong {
    #[error("took up no letter in a whole Period")]
    Missing,
    #[error("took up a letter other than the next one")]
    OutOfTurn,
    #[error("did not take up the letters of a Period in about one Period")]
    Pace,
    #[error("did not act on a letter")]
    Idle,
    #[error("did something that no rule for its letter gives")]
    Action,
    #[error("sent something that no rule for its letter gives")]
    Sent,
    #[error("did not send what the rule for its letter gives")]
    Unsent,
    #[error("did not adapt its action to its attitude")]
    Attitude,
    #[error("continued although it had an order to stop")]
    GoesOn,
    #[error("was not in step with the other leg of its branch")]
    Apart,
    #[error("led a ring that another module led, too")]
    Leads,
}

/// The findings about all modules.
#[derive(Default)]
pub struct Tally {
    /// Lines lose or change what goes over them.
    pub is_noisy: bool,
    /// How often something was wrong though it should have been right.
    pub violations: u64,
    pub first: Option<Violation>,
    /// The longest time from a change until nothing was wrong, in cycles.
    pub recovered_after: Option<u64>,
}

/// A module that hormones reach.
pub struct Walker {
    pub module: usize,
    module_type: ModuleType,
    gait: Gait,
    /// The docks that have a neighbour.
    connected: DockSet,
    /// Where its letters came from last.
    source: Option<Dock>,
    /// Whether its type has any rule.
    pub acts: bool,
    /// Hops from the leader.
    pub hops: u64,
    /// How many modules on the way of its hormones, itself among them, may have to follow hormones that come
    /// another way than before.
    choices: u64,
    /// The other leg of its branch, by its place among the walkers.
    pub other: Option<usize>,
    /// The last change that concerned it.
    disturbed_at: u64,
    /// The first change since it was last right, and the longest time that any has given it since.
    unsettled: Option<(u64, u64)>,
    /// From when on nothing may be wrong with it.
    pub settled_at: u64,
    /// Until when it may follow one order or another.
    doubted_until: u64,
    /// Whether it had had, before its last change, all the time that it has from power-up.
    has_settled: bool,
    pub step: Option<Step>,
    /// When it took up its last letters, as many as a Period has.
    letters_at: VecDeque<u64>,
    last_action: Option<Action>,
    /// When a letter is next found missing.
    overdue_at: u64,
    /// The time of the step since which the legs of the branch were apart, once that was found.
    pub apart_since: Option<u64>,
    /// The senses that rules for its type depend on.
    senses: Vec<Sensed>,
    /// Whether the robot was turned since sensors were looked at.
    is_turned: bool,
}

impl Walker {
    /// A module of this type that nothing was seen of yet. A call of [`disturbed`](Self::disturbed) follows.
    pub fn new(module: usize, neighbours: &Neighbours, gait: Gait, hops: u64) -> Self {
        let module_type = ModuleType::acting(neighbours);
        let rules = || gait.rules.iter().filter(|rule| rule.case().module_type() == module_type);
        let is_minded = |sense: &Sense| rules().any(|rule| rule.case() == rule.case().given(Some(*sense)));
        let sensed = |sense: Sense| Sensed { sense, holds: None, since: 0 };
        Walker {
            module,
            module_type,
            gait,
            connected: connected(neighbours),
            source: None,
            acts: rules().next().is_some(),
            hops,
            choices: 0,
            other: None,
            disturbed_at: 0,
            unsettled: None,
            settled_at: 0,
            doubted_until: 0,
            has_settled: false,
            step: None,
            letters_at: VecDeque::new(),
            last_action: None,
            overdue_at: 0,
            apart_since: None,
            senses: Sense::ALL.into_iter().filter(is_minded).map(sensed).collect(),
            is_turned: false,
        }
    }

    /// This module under other circumstances.
    pub fn changed(self, neighbours: &Neighbours, gait: Gait, hops: u64) -> Self {
        let changed = Walker::new(self.module, neighbours, gait, hops);
        let is_same = changed.senses.iter().map(|sensed| sensed.sense).eq(self.senses());
        let Walker { module_type, connected, acts, senses, .. } = changed;
        let senses = if is_same { self.senses } else { senses };
        Walker { module_type, connected, gait, acts, hops, senses, ..self }
    }

    pub fn is_leg(&self) -> bool {
        self.acts && matches!(self.module_type, ModuleType::LeftLeg | ModuleType::RightLeg)
    }

    /// Half a beat, in cycles: a quarter of the centipede's Period.
    pub fn half_beat(&self) -> u64 {
        self.beat() / 2
    }

    fn beat(&self) -> u64 {
        beat(&self.gait)
    }

    fn period(&self) -> u64 {
        u64::from(self.gait.period()) * MILLISECOND
    }

    /// How long it may take to be right after a change, where a frame and its ACK take so many tries.
    pub fn patience(&self, tries: f64) -> u64 {
        let election = election(self.gait.leader);
        let choice = self.choices * choice(&self.gait);
        self.period() + choice + ((DISCOVERY + election + self.hops * HOP) as f64 * tries) as u64
    }

    /// A change that concerns it has happened, after which so many modules may have to choose another way.
    /// Those of a change before may not have chosen yet, even if this module has done what is right since.
    pub fn disturbed(&mut self, choices: u64, now: u64, tries: f64) {
        let is_settled = self.settled_at <= now;
        self.has_settled |= 0 < now && is_settled;
        self.choices = if is_settled { choices } else { choices.max(self.choices) };
        let patience = self.patience(tries);
        let (since, longest) = self.unsettled.unwrap_or((now, 0));
        let longest = longest.max(patience);
        self.unsettled = Some((since, longest));
        self.disturbed_at = now;
        self.settled_at = (now + patience).min(since + MOST_PATIENCE * longest);
        self.overdue_at = self.settled_at;
    }

    /// Until then it may follow one order or another, as its body does.
    pub fn doubted(&mut self, until: u64) {
        self.doubted_until = until;
        self.settled_at = self.settled_at.max(until);
    }

    /// From `now` on frames take so many tries. A module that walks has to walk on.
    pub fn loses(&mut self, now: u64, tries: f64) {
        if self.settled_at > now {
            let patience = self.patience(tries);
            // Nothing that was right by the tries before becomes wrong after the fact.
            let soonest = self.doubted_until.max(self.disturbed_at + patience);
            self.settled_at = self.settled_at.min(now + patience).max(soonest);
            if self.step.is_none() {
                self.overdue_at = self.settled_at;
            }
        }
    }

    /// Whether it has not had time to be right since power-up.
    pub fn is_unjudged(&self, now: u64) -> bool {
        !self.has_settled && self.settled_at > now
    }

    /// The module takes up a letter, by way of a dock or from its timer.
    pub fn take(&mut self, at: u64, source: Source, from: Option<Dock>, data: Data, tally: &mut Tally) {
        self.pass(at, tally);
        let before = self.step.replace(Step { source, data, at, sent: DockSet::EMPTY, acted: None });
        let came_from = if from.is_some() { replace(&mut self.source, from) } else { self.source };
        self.overdue_at = at + self.period();
        let is_in_pace = self.keeps_pace(at);
        if let Some(before) = before {
            self.judge_attitude(before, at, tally);
            if before.acted.is_none() && self.rules(before).next().is_some() {
                return self.wrong(Wrong::Idle, at, tally);
            }
            if self.has_left_out(before, came_from, tally) {
                return self.wrong(Wrong::Unsent, at, tally);
            }
            if data != before.data.later(1, self.gait.beats) {
                return self.wrong(Wrong::OutOfTurn, at, tally);
            }
            if !is_in_pace {
                return self.wrong(Wrong::Pace, at, tally);
            }
        }
        if !self.acts {
            self.unsettled = None;
        }
    }

    /// Notes that a letter is taken up. Returns whether the letters of a Period came in about a Period, once
    /// all has to be right: a beat whose hormone is early is an eighth shorter.
    fn keeps_pace(&mut self, at: u64) -> bool {
        self.letters_at.push_back(at);
        let mut since = None;
        while self.letters_at.len() > usize::from(self.gait.beats) {
            since = self.letters_at.pop_front();
        }
        let period = self.period();
        let about = period * 3 / 4..=period * 3 / 2;
        since.is_none_or(|since| since < self.settled_at || about.contains(&(at - since)))
    }

    /// How long the last beat took, by when letters were taken up, in cycles.
    pub fn last_beat(&self) -> Option<u64> {
        let mut latest = self.letters_at.iter().rev();
        let last = latest.next()?;
        Some(last - latest.next()?)
    }

    /// Whether it leads at `now`: its last letter is its own, and less than a Period old.
    pub fn leads(&self, now: u64) -> bool {
        self.step.is_some_and(|step| step.source == Source::Timer && now < step.at + self.period())
    }

    /// The module begins an action.
    pub fn act(&mut self, at: u64, action: Action, tally: &mut Tally) {
        let step = self.step.filter(|step| step.acted.is_none());
        let is_right = step.is_some_and(|step| self.rules(step).any(|rule| rule.action() == action));
        if let Some(step) = &mut self.step {
            step.acted = Some((at, action));
        }
        let before = self.last_action.replace(action);
        if !is_right {
            self.wrong(Wrong::Action, at, tally);
            return;
        }
        if before.is_none_or(|before| before == Action::Rest) {
            self.recovered(at, tally);
        }
        self.unsettled = None;
    }

    /// The module hands a hormone to a dock's link.
    pub fn send(&mut self, at: u64, dock: Dock, data: Data, tally: &mut Tally) {
        let is_right = self.step.is_some_and(|step| match self.module_type {
            ModuleType::Other => data == step.data,
            _ => self.rules(step).any(|rule| {
                let send = rule.sends(step.data, self.gait.beats);
                send.is_some_and(|send| send.data == data && send.docks.contains(dock))
            }),
        });
        if let Some(step) = &mut self.step {
            step.sent.insert(dock);
        }
        if !is_right {
            self.wrong(Wrong::Sent, at, tally);
        }
    }

    /// Whether a module with rules has left out, at a step that is over, what they send to a neighbour other
    /// than the one that the letter came from. Lines that lose frames may leave no room for it.
    fn has_left_out(&self, step: Step, source: Option<Dock>, tally: &Tally) -> bool {
        let is_left_out = |dock: &Dock| !step.sent.contains(*dock) && Some(*dock) != source;
        let leaves_out = |rule: Rule| {
            let docks = rule.sends(step.data, self.gait.beats).map_or(DockSet::EMPTY, |send| send.docks);
            docks.intersection(self.connected).iter().any(|dock| is_left_out(&dock))
        };
        let mut rules = self.rules(step).map(leaves_out).peekable();
        !tally.is_noisy && self.acts && rules.peek().is_some() && rules.all(|is_left_out| is_left_out)
    }

    /// Time has passed up to `now`. After a whole Period without a letter one is missing, however long
    /// hormones took on their way.
    pub fn pass(&mut self, now: u64, tally: &mut Tally) {
        while self.overdue_at < now {
            let overdue_at = self.overdue_at;
            self.overdue_at += self.beat();
            self.wrong(Wrong::Missing, overdue_at, tally);
        }
    }

    /// The senses that rules for its type depend on.
    pub fn senses(&self) -> impl Iterator<Item = Sense> + '_ {
        self.senses.iter().map(|sensed| sensed.sense)
    }

    /// The robot was turned: what its sensors read now is not known before they are looked at.
    pub fn turned(&mut self) {
        self.is_turned = true;
    }

    /// The sensors of these senses, in the order of [`senses`](Self::senses), read this now, and were looked
    /// at last before. The robot was turned last at `turned_at`.
    pub fn feel(&mut self, values: &[i16], (before, now): (u64, u64), turned_at: u64) {
        for (sensed, &value) in self.senses.iter_mut().zip(values) {
            let holds = holds(sensed.sense, value);
            // It may have acted by other readings since the robot was turned, though these are as before.
            let is_turned = turned_at >= before;
            if is_turned || sensed.holds != holds {
                let since = if is_turned { turned_at } else { now };
                *sensed = Sensed { holds, since, ..*sensed };
            }
        }
        self.is_turned = false;
    }

    /// Judges whether a step that is over was done as the module lies, if it has lain so for long. A foot
    /// that was wrong in the step was wrong until its end.
    fn judge_attitude(&mut self, step: Step, end: u64, tally: &mut Tally) {
        let Some((acted_at, action)) = step.acted.filter(|_| !self.is_turned) else { return };
        let against = |&Sensed { sense, holds, since }: &Sensed| {
            let plain = self.gait.rule(self.case(step), step.data)?.action();
            let given = self.gait.rule(self.case(step).given(Some(sense)), step.data)?.action();
            let wrong = if holds? { plain } else { given };
            (plain != given && action == wrong).then_some(since)
        };
        let Some(since) = self.senses.iter().filter_map(against).max() else { return };
        tally.recover(end.saturating_sub(since.max(self.disturbed_at)));
        // A module that has just begun to walk has to take its posture before it can tell how it lies.
        if acted_at >= self.settled_at.max(since) + self.period() {
            tally.count(Violation { at: end, module: self.module, wrong: Wrong::Attitude });
        }
    }

    /// The rules for a step, whatever the module senses.
    fn rules(&self, step: Step) -> impl Iterator<Item = Rule> + '_ {
        let senses = self.senses().map(Some).chain([None]);
        senses.filter_map(move |sense| self.gait.rule(self.case(step).given(sense), step.data))
    }

    fn case(&self, step: Step) -> Case {
        Case::new(self.module_type, step.source)
    }

    /// From `at` on all may be right.
    fn recovered(&self, at: u64, tally: &mut Tally) {
        tally.recover(at.saturating_sub(self.disturbed_at));
    }

    pub fn wrong(&self, wrong: Wrong, at: u64, tally: &mut Tally) {
        self.recovered(at, tally);
        if at >= self.settled_at {
            tally.count(Violation { at, module: self.module, wrong });
        }
    }
}

impl Tally {
    pub fn count(&mut self, violation: Violation) {
        self.violations += 1;
        self.first.get_or_insert(violation);
    }

    fn recover(&mut self, cycles: u64) {
        self.recovered_after = self.recovered_after.max(Some(cycles));
    }
}

/// Whether a sense holds at this reading; `None` between its bounds, or little beyond them.
fn holds(sense: Sense, value: i16) -> Option<bool> {
    let [begins, ends] = sense.bounds();
    let sign = if begins < ends { -1 } else { 1 };
    let beyond = |bound: i16| sign * (i32::from(value) - i32::from(bound));
    match () {
        () if beyond(begins) > MARGIN => Some(true),
        () if beyond(ends) < -MARGIN => Some(false),
        () => None,
    }
}

#[cfg(test)]
mod tests {
    use hormone::action::Action::Wave;
    use hormone::data::Data::{A, B};
    use hormone::module_type::ModuleType::{Head, Spine, Tail};
    use hormone::rule::{BACK, received, timer};

    use super::*;

    hormone::gait! {
        beats: 2,
        beat: 200,
        leader: Leader::Head,
        rules: [
            timer(Head, A).to(B).perform(Wave).send(A, BACK),
            received(Spine, A).to(B).perform(Wave).send(A, BACK),
            received(Tail, A).perform(Wave),
        ],
    }

    #[test]
    fn a_letter_without_a_rule_leaves_nothing_to_send() {
        let mut neighbours = [None; 6];
        neighbours[usize::from(Dock::Front.index())] = Some(Dock::Back);
        let (mut tail, mut tally) = (Walker::new(1, &neighbours, GAIT, 1), Tally::default());
        tail.disturbed(0, 0, 1.0);
        for beat in 0..20 {
            let at = beat * 200 * MILLISECOND;
            let data = if beat % 2 == 0 { A } else { B };
            tail.take(at, Source::Hormone, Some(Dock::Front), data, &mut tally);
            if data == A {
                tail.act(at, Wave, &mut tally);
            }
        }
        assert_eq!((tally.violations, tally.first.map(|first| first.wrong)), (0, None));
    }
}
