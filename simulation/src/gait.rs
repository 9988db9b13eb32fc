//! Whether a robot walks: in each half Period every leg swings or holds, not as it did in the one before, and
//! not as the other leg of its branch does (paper, section 7), and every module of the trunk keeps straight.
//! Modules that no hormone can reach are not looked at, nor those for which Table 1 has no rule, nor a robot
//! that was ordered to walk by another gait. A robot that is turned over has to lift its feet the other way
//! within a Period.
//!
//! A change of the robot disturbs the gait. It has one Period and the time of discovery to come right again,
//! and a few milliseconds for each module between a walker and its head; where frames are lost, discovery and
//! hops have as many times more as a frame and its ACK take tries. What is wrong tells how long it took, and
//! is a violation where it comes later than that.

use std::collections::VecDeque;

use hormone::action::Action;
use hormone::event::Event;
use hormone::gait::GaitName;
use hormone::module_type::ModuleType;
use tasks::dock::Dock;

use crate::deed::Deed;
use crate::hardware::MILLISECOND;
use crate::wiring::{Face, Wiring};

/// How long modules may take to notice a change: that a neighbour is gone is the slowest.
const DISCOVERY: u64 = 300 * MILLISECOND;

/// How long a hormone may take from a module to the next.
const HOP: u64 = 5 * MILLISECOND;

/// A robot that is turned by no more than this is on its feet, and by no less than that on its back, in
/// degrees: whatever a leg lifts, by 30 degrees, its accelerometer is past the bounds of
/// [`UpsideDown`](hormone::sense::Sense::UpsideDown). Between them either way to lift a foot is right.
const ON_FEET: f64 = 74.0;
const ON_BACK: f64 = 151.0;

/// What a walker did last, and since when.
#[derive(Clone, Copy)]
struct Beat {
    cycle: u64,
    action: Action,
}

/// A module for which there is a rule, by the wiring.
struct Walker {
    module: usize,
    is_leg: bool,
    /// From the nearest head.
    hops: u64,
    /// The other leg of its branch, by its place among the walkers.
    other: Option<usize>,
    /// From when on nothing may be wrong with it.
    settled_at: u64,
    beat: Option<Beat>,
    /// When something of this walker is next found missing.
    overdue_at: u64,
    /// The beat since which both legs of the branch did the same, once that was found.
    together_since: Option<u64>,
}

/// Follows the walkers.
pub struct Gait {
    /// In cycles.
    period: u64,
    /// Whether it walks by the gait that is judged here.
    is_centipede: bool,
    walkers: Vec<Walker>,
    /// By module, which walker it is.
    walker_of: Vec<Option<usize>>,
    disturbed_at: u64,
    /// By how many degrees the robot is turned about its long axis, and since when.
    roll: f64,
    rolled_at: u64,
    /// How often a frame is sent until it and its ACK have arrived, on the mean.
    tries: f64,
    /// What was wrong though it should have been right.
    pub violations: u64,
    /// The longest time from a change until nothing was wrong, in cycles.
    recovered_after: Option<u64>,
    /// The most that the legs of a branch started apart, in cycles.
    pub skew_max: Option<u64>,
    /// Beats of walkers.
    pub beats: u64,
}

impl Gait {
    /// A robot at power-up. `period` is in cycles.
    pub fn new(wiring: &Wiring, period: u64) -> Self {
        let mut gait = Gait {
            period,
            is_centipede: true,
            walkers: Vec::new(),
            walker_of: Vec::new(),
            disturbed_at: 0,
            roll: 0.0,
            rolled_at: 0,
            tries: 1.0,
            violations: 0,
            recovered_after: None,
            skew_max: None,
            beats: 0,
        };
        gait.disturbed(wiring, 0);
        gait
    }

    pub fn legs(&self) -> usize {
        self.walkers.iter().filter(|walker| walker.is_leg).count()
    }

    /// Something was changed, and the wiring is this now.
    pub fn disturbed(&mut self, wiring: &Wiring, now: u64) {
        self.disturbed_at = now;
        let beats: Vec<(usize, Option<Beat>)> =
            self.walkers.iter().map(|walker| (walker.module, walker.beat)).collect();
        self.walkers.clear();
        self.walker_of = vec![None; wiring.modules()];
        if !self.is_centipede {
            return;
        }
        for (module, hops) in hops_from_heads(wiring).into_iter().enumerate() {
            let (Some(hops), Some(part)) = (hops, part(wiring, module)) else { continue };
            let settled_at = self.settled_at(hops);
            self.walker_of[module] = Some(self.walkers.len());
            self.walkers.push(Walker {
                module,
                is_leg: part == Part::Leg,
                hops,
                other: None,
                settled_at,
                beat: None,
                overdue_at: settled_at,
                together_since: None,
            });
        }
        for (module, beat) in beats {
            if let Some(walker) = self.walker_of[module] {
                self.walkers[walker].beat = beat;
            }
        }
        for walker in self.walkers.iter_mut().filter(|walker| walker.is_leg) {
            walker.other = other_leg(wiring, walker.module).and_then(|other| self.walker_of[other]);
        }
    }

    /// The robot was ordered to walk by this gait; a call of [`disturbed`](Self::disturbed) follows.
    pub fn ordered(&mut self, gait: GaitName) {
        self.is_centipede = gait == GaitName::Centipede;
    }

    /// The robot lies turned about its long axis by so many degrees from now on.
    pub fn rolled(&mut self, degrees: f64, now: u64) {
        self.roll = degrees;
        self.rolled_at = now;
    }

    /// When a walker so many hops from its head has to walk again.
    fn settled_at(&self, hops: u64) -> u64 {
        let once = (DISCOVERY + hops * HOP) as f64;
        self.disturbed_at + self.period + (once * self.tries) as u64
    }

    /// From `now` on frames are lost with this probability, each way. Who walks has to walk on.
    pub fn loses(&mut self, probability: f64, now: u64) {
        let arrives = (1.0 - probability).max(0.1);
        self.tries = 1.0 / (arrives * arrives);
        for number in 0..self.walkers.len() {
            let settled_at = self.settled_at(self.walkers[number].hops);
            let walker = &mut self.walkers[number];
            if walker.settled_at > now {
                walker.settled_at = settled_at;
                if walker.beat.is_none() {
                    walker.overdue_at = settled_at;
                }
            }
        }
    }

    /// How long it took at most from power-up, or from a change, until nothing was wrong, in Periods.
    pub fn recovery_periods(&self) -> Option<f64> {
        self.recovered_after.map(|cycles| cycles as f64 / self.period as f64)
    }

    /// Takes in the next deed.
    pub fn take(&mut self, deed: &Deed) {
        if let Event::ActionBegun(action) = deed.event
            && let Some(walker) = self.walker_of[deed.module]
        {
            self.look_at(walker, deed.cycle);
            self.beat(walker, Beat { cycle: deed.cycle, action });
        }
    }

    /// Time has passed up to `now`.
    pub fn pass(&mut self, now: u64) {
        for walker in 0..self.walkers.len() {
            self.look_at(walker, now);
        }
    }

    fn look_at(&mut self, walker: usize, now: u64) {
        self.look_for_missing(walker, now);
        let other = self.walkers[walker].other;
        self.look_for_together(other.map_or(walker, |other| walker.min(other)), now);
    }

    fn beat(&mut self, walker: usize, beat: Beat) {
        let Walker { is_leg, other, settled_at, .. } = self.walkers[walker];
        let before = self.walkers[walker].beat.replace(beat);
        self.walkers[walker].overdue_at = beat.cycle + self.period;
        self.beats += 1;
        let is_right = match beat.action {
            Action::Swing | Action::SwingOver | Action::Holding | Action::HoldingOver => {
                is_leg && before.is_none_or(|before| step(before.action) != step(beat.action))
            }
            action => !is_leg && action == Action::Straight,
        };
        if let Some(before) = before {
            self.look_for_wrong_way(walker, before, beat.cycle);
        }
        if !is_right {
            self.wrong(walker, beat.cycle);
        } else if before.is_none_or(|before| before.action == Action::Rest) {
            self.recovered(beat.cycle);
        }
        let others = other.and_then(|other| self.walkers[other].beat);
        if let Some(others) = others
            && beat.cycle >= settled_at
        {
            let apart = beat.cycle.abs_diff(others.cycle);
            if apart <= self.period / 4 {
                self.skew_max = self.skew_max.max(Some(apart));
            }
        }
    }

    /// Two half Periods without a beat: one was missed, whatever the hormones took on their way.
    fn look_for_missing(&mut self, walker: usize, now: u64) {
        while self.walkers[walker].overdue_at < now {
            let overdue_at = self.walkers[walker].overdue_at;
            self.walkers[walker].overdue_at += self.period / 2;
            self.wrong(walker, overdue_at);
        }
    }

    /// A beat in which a foot was lifted the wrong way is over.
    fn look_for_wrong_way(&mut self, walker: usize, beat: Beat, end: u64) {
        let is_wrong = match beat.action {
            Action::Swing => self.roll.abs() >= ON_BACK,
            Action::SwingOver => self.roll.abs() <= ON_FEET,
            _ => false,
        };
        if !is_wrong {
            return;
        }
        // A leg that has just begun to walk has to roll upright before it can tell.
        let settled_at = self.walkers[walker].settled_at.max(self.rolled_at) + self.period;
        let since = self.rolled_at.max(self.disturbed_at);
        self.recovered_after = self.recovered_after.max(Some(end.saturating_sub(since)));
        if beat.cycle >= settled_at {
            self.violations += 1;
        }
    }

    /// Both legs of a branch do the same for longer than a quarter of a Period.
    fn look_for_together(&mut self, leg: usize, now: u64) {
        let Walker { other, beat, together_since, .. } = self.walkers[leg];
        let others = other.filter(|other| leg < *other).and_then(|other| self.walkers[other].beat);
        let (Some(one), Some(other)) = (beat, others) else { return };
        let since = one.cycle.max(other.cycle);
        let found_at = since + self.period / 4;
        if step(one.action) == step(other.action) && now > found_at && together_since != Some(since) {
            self.walkers[leg].together_since = Some(since);
            self.wrong(leg, found_at);
        }
    }

    /// From now on all may be right.
    fn recovered(&mut self, at: u64) {
        self.recovered_after = self.recovered_after.max(Some(at.saturating_sub(self.disturbed_at)));
    }

    fn wrong(&mut self, walker: usize, at: u64) {
        self.recovered(at);
        if at >= self.walkers[walker].settled_at {
            self.violations += 1;
        }
    }
}

/// What a leg does, whichever way up it lies.
fn step(action: Action) -> Action {
    match action {
        Action::SwingOver => Action::Swing,
        Action::HoldingOver => Action::Holding,
        action => action,
    }
}

/// What Table 1 has a module do.
#[derive(PartialEq)]
enum Part {
    Trunk,
    Leg,
}

/// A module's part by the wiring; `None` where there is no rule.
fn part(wiring: &Wiring, module: usize) -> Option<Part> {
    match ModuleType::acting(&wiring.neighbours(module)) {
        ModuleType::Head | ModuleType::Spine | ModuleType::Branch => Some(Part::Trunk),
        ModuleType::LeftLeg | ModuleType::RightLeg => Some(Part::Leg),
        ModuleType::Tail | ModuleType::Other => None,
    }
}

/// The docks by which a module sends hormones on.
fn ways(wiring: &Wiring, module: usize) -> &'static [Dock] {
    match ModuleType::acting(&wiring.neighbours(module)) {
        ModuleType::Head | ModuleType::Branch => &[Dock::Left, Dock::Right, Dock::Back],
        ModuleType::Spine => &[Dock::Back],
        ModuleType::Other => &Dock::ALL,
        ModuleType::Tail | ModuleType::LeftLeg | ModuleType::RightLeg => &[],
    }
}

/// How many hops hormones take to each module from the nearest head; `None` where none can come.
fn hops_from_heads(wiring: &Wiring) -> Vec<Option<u64>> {
    let is_head = |module: &usize| ModuleType::acting(&wiring.neighbours(*module)) == ModuleType::Head;
    let mut next: VecDeque<(usize, u64)> =
        (0..wiring.modules()).filter(is_head).map(|head| (head, 0)).collect();
    let mut hops = vec![None; wiring.modules()];
    while let Some((module, distance)) = next.pop_front() {
        if hops[module].is_some() {
            continue;
        }
        hops[module] = Some(distance);
        let peers = ways(wiring, module).iter().filter_map(|&dock| wiring.peer(Face { module, dock }));
        next.extend(peers.map(|peer| (peer.module, distance + 1)));
    }
    hops
}

/// The leg on the other side of the branch.
fn other_leg(wiring: &Wiring, leg: usize) -> Option<usize> {
    let at_branch = wiring.peer(Face { module: leg, dock: Dock::Back })?;
    let other_side = if at_branch.dock == Dock::Left { Dock::Right } else { Dock::Left };
    wiring.peer(Face { dock: other_side, ..at_branch }).map(|other| other.module)
}
