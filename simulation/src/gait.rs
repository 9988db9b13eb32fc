//! Whether legs walk: in each half Period every leg swings or holds, not as it did in the one before, and not as the
//! other leg of its branch does (paper, section 7).
//!
//! A change of the robot disturbs the gait. It has one Period and the time of discovery to come right again, and a few
//! milliseconds for each module between a leg and the head; what is wrong meanwhile tells how long it took, and what is
//! wrong later is a violation.

use std::collections::VecDeque;

use hormone::action::Action;
use hormone::event::Event;
use hormone::module_type::ModuleType;
use tasks::dock::Dock;

use crate::deed::Deed;
use crate::hardware::MILLISECOND;
use crate::wiring::{Face, Wiring};

/// How long modules may take to notice a change: that a neighbour is gone is the slowest.
const DISCOVERY: u64 = 300 * MILLISECOND;

/// How long a hormone may take from a module to the next.
const HOP: u64 = 5 * MILLISECOND;

/// What a leg did last, and since when.
#[derive(Clone, Copy)]
struct Beat {
    cycle: u64,
    action: Action,
}

/// A leg by the wiring.
struct Leg {
    module: usize,
    /// The other leg of its branch, by its place among the legs.
    other: Option<usize>,
    /// From when on nothing may be wrong with it.
    settled_at: u64,
    beat: Option<Beat>,
    /// When something of this leg is next found missing.
    overdue_at: u64,
    /// The beat since which both legs of the branch did the same, once that was found.
    together_since: Option<u64>,
}

/// Follows the legs.
pub struct Gait {
    /// In cycles.
    period: u64,
    legs: Vec<Leg>,
    /// By module, which leg it is.
    leg_of: Vec<Option<usize>>,
    disturbed_at: u64,
    /// What was wrong though it should have been right.
    pub violations: u64,
    /// The longest time from a change until nothing was wrong, in cycles.
    recovered_after: Option<u64>,
    /// The most that the legs of a branch started apart, in cycles.
    pub skew_max: Option<u64>,
    /// Beats of legs.
    pub beats: u64,
}

impl Gait {
    /// A robot at power-up. `period` is in cycles.
    pub fn new(wiring: &Wiring, period: u64) -> Self {
        let mut gait = Gait {
            period,
            legs: Vec::new(),
            leg_of: Vec::new(),
            disturbed_at: 0,
            violations: 0,
            recovered_after: None,
            skew_max: None,
            beats: 0,
        };
        gait.disturbed(wiring, 0);
        gait
    }

    pub fn legs(&self) -> usize {
        self.legs.len()
    }

    /// Something was changed, and the wiring is this now.
    pub fn disturbed(&mut self, wiring: &Wiring, now: u64) {
        self.disturbed_at = now;
        let hops = hops_from_heads(wiring);
        let beats: Vec<(usize, Option<Beat>)> = self.legs.iter().map(|leg| (leg.module, leg.beat)).collect();
        self.legs.clear();
        self.leg_of = vec![None; wiring.modules()];
        for (module, hops) in hops.into_iter().enumerate() {
            if matches!(wiring.module_type(module), ModuleType::LeftLeg | ModuleType::RightLeg) {
                let settled_at = now + self.period + DISCOVERY + hops * HOP;
                self.leg_of[module] = Some(self.legs.len());
                self.legs.push(Leg {
                    module,
                    other: None,
                    settled_at,
                    beat: None,
                    overdue_at: settled_at,
                    together_since: None,
                });
            }
        }
        for (module, beat) in beats {
            if let Some(leg) = self.leg_of[module] {
                self.legs[leg].beat = beat;
            }
        }
        for leg in &mut self.legs {
            leg.other = other_leg(wiring, leg.module).and_then(|other| self.leg_of[other]);
        }
    }

    /// How long it took at most from power-up, or from a change, until nothing was wrong, in Periods.
    pub fn recovery_periods(&self) -> Option<f64> {
        self.recovered_after.map(|cycles| cycles as f64 / self.period as f64)
    }

    /// Takes in the next deed.
    pub fn take(&mut self, deed: &Deed) {
        if let Event::ActionBegun(action) = deed.event
            && let Some(leg) = self.leg_of[deed.module]
        {
            self.look_at(leg, deed.cycle);
            self.beat(leg, Beat { cycle: deed.cycle, action });
        }
    }

    /// Time has passed up to `now`.
    pub fn pass(&mut self, now: u64) {
        for leg in 0..self.legs.len() {
            self.look_at(leg, now);
        }
    }

    fn look_at(&mut self, leg: usize, now: u64) {
        self.look_for_missing(leg, now);
        let other = self.legs[leg].other;
        self.look_for_together(other.map_or(leg, |other| leg.min(other)), now);
    }

    fn beat(&mut self, leg: usize, beat: Beat) {
        let Leg { other, settled_at, .. } = self.legs[leg];
        let before = self.legs[leg].beat.replace(beat);
        self.legs[leg].overdue_at = beat.cycle + self.period;
        self.beats += 1;
        let is_leg_action = matches!(beat.action, Action::Swing | Action::Holding);
        let repeats = before.is_some_and(|before| before.action == beat.action);
        if !is_leg_action || repeats {
            self.wrong(leg, beat.cycle);
        } else if before.is_none_or(|before| before.action == Action::Rest) {
            self.recovered(beat.cycle);
        }
        let others = other.and_then(|other| self.legs[other].beat);
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
    fn look_for_missing(&mut self, leg: usize, now: u64) {
        while self.legs[leg].overdue_at < now {
            let overdue_at = self.legs[leg].overdue_at;
            self.legs[leg].overdue_at += self.period / 2;
            self.wrong(leg, overdue_at);
        }
    }

    /// Both legs of a branch do the same for longer than a quarter of a Period.
    fn look_for_together(&mut self, leg: usize, now: u64) {
        let Leg { other, beat, together_since, .. } = self.legs[leg];
        let others = other.filter(|other| leg < *other).and_then(|other| self.legs[other].beat);
        let (Some(one), Some(other)) = (beat, others) else { return };
        let since = one.cycle.max(other.cycle);
        let found_at = since + self.period / 4;
        if one.action == other.action && now > found_at && together_since != Some(since) {
            self.legs[leg].together_since = Some(since);
            self.wrong(leg, found_at);
        }
    }

    /// From now on all may be right.
    fn recovered(&mut self, at: u64) {
        self.recovered_after = self.recovered_after.max(Some(at.saturating_sub(self.disturbed_at)));
    }

    fn wrong(&mut self, leg: usize, at: u64) {
        if at < self.legs[leg].settled_at {
            self.recovered(at);
        } else {
            self.violations += 1;
        }
    }
}

/// How many hops each module is from the nearest head.
fn hops_from_heads(wiring: &Wiring) -> Vec<u64> {
    let mut hops = vec![0; wiring.modules()];
    let mut is_found: Vec<bool> =
        (0..wiring.modules()).map(|module| wiring.module_type(module) == ModuleType::Head).collect();
    let mut next: VecDeque<usize> = (0..wiring.modules()).filter(|&module| is_found[module]).collect();
    while let Some(module) = next.pop_front() {
        for peer in Dock::ALL.iter().filter_map(|&dock| wiring.peer(Face { module, dock })) {
            if !std::mem::replace(&mut is_found[peer.module], true) {
                hops[peer.module] = hops[module] + 1;
                next.push_back(peer.module);
            }
        }
    }
    hops
}

/// The leg on the other side of the branch.
fn other_leg(wiring: &Wiring, leg: usize) -> Option<usize> {
    let at_branch = wiring.peer(Face { module: leg, dock: Dock::Back })?;
    let other_side = if at_branch.dock == Dock::Left { Dock::Right } else { Dock::Left };
    wiring.peer(Face { dock: other_side, ..at_branch }).map(|other| other.module)
}
