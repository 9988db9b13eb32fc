//! Whether legs walk: in each half Period every leg swings or holds, not as it did in the one before, and not as the
//! other leg of its branch does (paper, section 7).
//!
//! A change of the robot disturbs the gait. It has one Period and the time of discovery to come right again; what is
//! wrong meanwhile tells how long it took, and what is wrong later is a violation.

use std::collections::BTreeMap;

use hormone::action::Action;
use hormone::event::Event;
use hormone::module_type::ModuleType;
use tasks::dock::Dock;

use crate::deed::Deed;
use crate::hardware::MILLISECOND;
use crate::robot::Robot;
use crate::wiring::{Face, Wiring};

/// How long modules may take to notice a change: that a neighbour is gone is the slowest.
const DISCOVERY: u64 = 300 * MILLISECOND;

/// What a leg did last, and since when.
#[derive(Clone, Copy)]
struct Beat {
    cycle: u64,
    action: Action,
}

/// A leg by the wiring.
struct Leg {
    other: Option<usize>,
    beat: Option<Beat>,
    /// When it took up hormones since the robot was last looked at.
    taken_up: Vec<u64>,
    /// When something of this leg is next found missing.
    overdue_at: u64,
    /// The beat since which both legs of the branch did the same, once that was found.
    together_since: Option<u64>,
}

/// Follows the legs.
pub struct Gait {
    /// In cycles.
    period: u64,
    legs: BTreeMap<usize, Leg>,
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
            legs: BTreeMap::new(),
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
        let overdue_at = self.settled_at();
        let mut before = std::mem::take(&mut self.legs);
        for module in 0..wiring.modules() {
            if !matches!(wiring.module_type(module), ModuleType::LeftLeg | ModuleType::RightLeg) {
                continue;
            }
            let beat = before.remove(&module).and_then(|leg| leg.beat);
            let other = other_leg(wiring, module);
            self.legs
                .insert(module, Leg { other, beat, taken_up: Vec::new(), overdue_at, together_since: None });
        }
    }

    /// How long it took at most from power-up, or from a change, until nothing was wrong, in Periods.
    pub fn recovery_periods(&self) -> Option<f64> {
        self.recovered_after.map(|cycles| cycles as f64 / self.period as f64)
    }

    /// From when on nothing may be wrong.
    fn settled_at(&self) -> u64 {
        self.disturbed_at + self.period + DISCOVERY
    }

    /// Takes in the next deed.
    pub fn take(&mut self, deed: &Deed) {
        if let Event::HormoneReceived(..) = deed.event
            && let Some(leg) = self.legs.get_mut(&deed.module)
        {
            leg.taken_up.push(deed.cycle);
        }
    }

    /// Looks at the legs: at least four times in a half Period.
    pub fn look(&mut self, robot: &impl Robot) {
        let modules: Vec<usize> = self.legs.keys().copied().collect();
        for &module in &modules {
            let Some(leg) = self.legs.get_mut(&module) else { continue };
            for cycle in std::mem::take(&mut leg.taken_up) {
                if let Some(status) = robot.status(module) {
                    self.beat(module, Beat { cycle, action: status.action });
                }
            }
        }
        for module in modules {
            self.look_for_missing(module, robot.now());
            self.look_for_together(module, robot.now());
        }
    }

    fn beat(&mut self, module: usize, beat: Beat) {
        let period = self.period;
        let Some(leg) = self.legs.get_mut(&module) else { return };
        let before = leg.beat.replace(beat);
        leg.overdue_at = beat.cycle + period;
        let other = leg.other;
        self.beats += 1;
        let is_leg_action = matches!(beat.action, Action::Swing | Action::Holding);
        let repeats = before.is_some_and(|before| before.action == beat.action);
        if !is_leg_action || repeats {
            self.wrong(beat.cycle);
        } else if before.is_none() {
            self.recovered(beat.cycle);
        }
        let others = other.and_then(|other| self.legs.get(&other)?.beat);
        if let Some(others) = others
            && beat.cycle >= self.settled_at()
        {
            let apart = beat.cycle.abs_diff(others.cycle);
            if apart <= period / 4 {
                self.skew_max = self.skew_max.max(Some(apart));
            }
        }
    }

    /// Two half Periods without a beat: one was missed, whatever the hormones took on their way.
    fn look_for_missing(&mut self, module: usize, now: u64) {
        let half_period = self.period / 2;
        while let Some(leg) = self.legs.get_mut(&module)
            && leg.overdue_at < now
        {
            let overdue_at = leg.overdue_at;
            leg.overdue_at += half_period;
            self.wrong(overdue_at);
        }
    }

    /// Both legs of a branch do the same for longer than a quarter of a Period.
    fn look_for_together(&mut self, module: usize, now: u64) {
        let Some(leg) = self.legs.get(&module) else { return };
        let other = leg.other.filter(|other| module < *other);
        let others = other.and_then(|other| self.legs.get(&other)?.beat);
        let (Some(one), Some(other)) = (leg.beat, others) else { return };
        let since = one.cycle.max(other.cycle);
        if one.action == other.action
            && now > since + self.period / 4
            && leg.together_since != Some(since)
            && let Some(leg) = self.legs.get_mut(&module)
        {
            leg.together_since = Some(since);
            self.wrong(since + self.period / 4);
        }
    }

    /// From now on all may be right.
    fn recovered(&mut self, at: u64) {
        self.recovered_after = self.recovered_after.max(Some(at.saturating_sub(self.disturbed_at)));
    }

    fn wrong(&mut self, at: u64) {
        if at < self.settled_at() {
            self.recovered(at);
        } else {
            self.violations += 1;
        }
    }
}

/// The leg on the other side of the branch.
fn other_leg(wiring: &Wiring, leg: usize) -> Option<usize> {
    let at_branch = wiring.peer(Face { module: leg, dock: Dock::Back })?;
    let other_side = if at_branch.dock == Dock::Left { Dock::Right } else { Dock::Left };
    wiring.peer(Face { dock: other_side, ..at_branch }).map(|other| other.module)
}
