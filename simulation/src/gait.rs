//! Judges whether a robot walks. Every module that hormones reach has to take up their letters in turn, one a
//! beat, and do at each letter what the rules of its type say, in the [tables](mod@hormone::gait) that the
//! robot itself goes by (for the centipede, the paper's Table 1). It also has to send what they say. The legs
//! of a branch have to be in step with each other, and a ring that elects its leader has to have one. A
//! module whose rules depend on a sense has to act by it.
//!
//! A change of the robot disturbs the modules at which it happens, those around, and all that get their
//! hormones by way of them; no others. These have one Period and the time of discovery to come right again, a
//! few milliseconds for each module between them and the leader, and in a ring the time of an election. Where
//! frames are lost, discovery, hops and election have as many times that as a frame and its ACK take tries.
//! Modules that may have to follow hormones by another way than before have time for that.
//! Another change before they are right prolongs the time, to three times the longest of these at most.
//! Whatever is wrong shows how long recovery took, and is a violation if it comes later than that.

use std::iter::successors;
use std::mem::replace;

use hormone::action::Action;
use hormone::case::Source;
use hormone::event::Event;
use hormone::period::Period;
use hormone::sense::Sense;
use hormone::status::Status;
use tasks::dock::{Dock, DockSet};

use crate::native::devices::value;
use crate::orders::Orders;
use crate::reach::{Way, concerned, led_by, shortest_ways, ways};
use crate::robot::Robot;
use crate::trace_event::TraceEvent;
use crate::walker::{DISCOVERY, HOP, Tally, Violation, Walker, Wrong, choice};
use crate::wiring::{Face, Wiring};

/// Follows the modules that hormones reach.
pub struct Gait {
    /// The Period, in cycles: recovery is measured in it.
    period: u64,
    orders: Orders,
    /// The wiring as far as modules can find it out.
    wiring: Wiring,
    /// By module, the docks by which hormones come to it, or came last.
    ways: Vec<DockSet>,
    /// By module, since when none come.
    cut_off_at: Vec<Option<u64>>,
    /// By module, until when it led.
    led_until: Vec<Option<u64>>,
    walkers: Vec<Walker>,
    /// By module, which walker it is.
    walker_of: Vec<Option<usize>>,
    /// By module, from when on it has to do nothing.
    halted: Vec<Option<u64>>,
    /// When the robot was turned last, and when sensors were looked at.
    turned_at: u64,
    felt_at: u64,
    /// How often a frame is sent, on average, until it and its ACK have arrived.
    tries: f64,
    /// When lines last became good or bad.
    lines_since: u64,
    tally: Tally,
    /// The most that the legs of a branch started apart, in cycles.
    pub skew_max: Option<u64>,
    /// Actions that were begun.
    pub beats: u64,
}

impl Gait {
    /// A robot at power-up. `period` is in cycles.
    pub fn new(wiring: &Wiring, period: u64) -> Self {
        let mut gait = Gait {
            period,
            orders: Orders::new(wiring.modules()),
            wiring: wiring.clone(),
            ways: vec![DockSet::EMPTY; wiring.modules()],
            cut_off_at: vec![None; wiring.modules()],
            led_until: vec![None; wiring.modules()],
            walkers: Vec::new(),
            walker_of: vec![None; wiring.modules()],
            halted: vec![None; wiring.modules()],
            turned_at: 0,
            felt_at: 0,
            tries: 1.0,
            lines_since: 0,
            tally: Tally::default(),
            skew_max: None,
            beats: 0,
        };
        gait.follow(&vec![true; wiring.modules()], 0);
        gait
    }

    pub fn legs(&self) -> usize {
        self.walkers.iter().filter(|walker| walker.is_leg()).count()
    }

    /// Whether there are legs, each with another one on the other side.
    pub fn has_pairs_of_legs(&self) -> bool {
        let mut legs = self.walkers.iter().filter(|walker| walker.is_leg()).peekable();
        legs.peek().is_some() && legs.all(|leg| leg.other.is_some())
    }

    /// Whether hormones reach any module, or any was ordered to stop.
    pub fn is_led(&self) -> bool {
        !self.walkers.is_empty() || self.halted.iter().any(Option::is_some)
    }

    /// How often something was wrong though it should have been right.
    pub fn violations(&self) -> u64 {
        self.tally.violations
    }

    /// The first violation.
    pub fn first_violation(&self) -> Option<Violation> {
        self.tally.first
    }

    /// The longest time from power-up, or from a change, until nothing was wrong, in Periods.
    pub fn recovery_periods(&self) -> Option<f64> {
        self.tally.recovered_after.map(|cycles| cycles as f64 / self.period as f64)
    }

    /// How many modules have not had time to be right by `now`, and until when the last of them has time, in
    /// cycles since power-up.
    pub fn unjudged(&self, now: u64) -> Option<(usize, u64)> {
        let unjudged = || self.walkers.iter().filter(|walker| walker.is_unjudged(now));
        Some((unjudged().count(), unjudged().map(|walker| walker.settled_at).max()?))
    }

    /// Takes in a change at these modules, and the wiring after it. Returns the modules that it concerns, and
    /// until when.
    pub fn disturbed(&mut self, wiring: &Wiring, at: &[usize], now: u64) -> Vec<(usize, u64)> {
        let mut touched = self.wiring.differences(wiring);
        touched.extend(at);
        let mut disturbed = concerned(&self.wiring, &self.orders, &touched);
        // By the orders from before, and by those from now on.
        touched.extend(self.orders.rewired(&self.wiring, wiring, now));
        let since = concerned(wiring, &self.orders, &touched);
        disturbed.iter_mut().zip(since).for_each(|(before, since)| *before |= since);
        self.wiring = wiring.clone();
        self.follow(&disturbed, now);
        self.unsettled(&disturbed)
    }

    /// The body of a module was ordered to walk by the gait of this name in this Period, or to stop. Returns
    /// the modules that this concerns, and until when.
    pub fn ordered(&mut self, module: usize, gait: u8, period: Period, now: u64) -> Vec<(usize, u64)> {
        let touched = self.orders.give(&self.wiring, module, (gait, period), now);
        self.touched(&touched, now)
    }

    /// Whether a dock, to which nothing is attached, may miss what comes in by `now`.
    pub fn may_miss(&self, face: Face, now: u64) -> bool {
        self.orders.may_miss(face, now)
    }

    /// An order that comes to a module may be lost: programs of it start over, or its dock may miss it.
    pub fn interrupted(&mut self, module: usize, now: u64) {
        self.orders.interrupted(&self.wiring, module, now);
    }

    /// A module starts over, and runs again from `runs_at` on.
    pub fn restarted(&mut self, module: usize, runs_at: u64) {
        self.orders.restarted(module, runs_at);
    }

    /// Has robots that have taken another shape walk on. Returns the modules that this concerns, and until
    /// when.
    pub fn reshaped(&mut self, now: u64) -> Vec<(usize, u64)> {
        match self.orders.next() {
            Some(at) if at <= now => {
                let touched = self.orders.settle(&self.wiring, at);
                self.touched(&touched, at)
            }
            _ => Vec::new(),
        }
    }

    /// Lets robots walk on that say that they already do, if they may. Returns the modules that this
    /// concerns, and until when.
    pub fn listen(&mut self, robot: &impl Robot) -> Vec<(usize, u64)> {
        let beat = |module: usize| self.walkers[self.walker_of[module]?].last_beat();
        let touched = self.orders.choose(&self.wiring, robot.now(), |module| robot.status(module), beat);
        if touched.is_empty() { Vec::new() } else { self.touched(&touched, robot.now()) }
    }

    fn touched(&mut self, touched: &[usize], now: u64) -> Vec<(usize, u64)> {
        let disturbed = concerned(&self.wiring, &self.orders, touched);
        self.follow(&disturbed, now);
        self.unsettled(&disturbed)
    }

    /// Until when modules may be disturbed: those that no leader's hormones reach until they do. A beat may
    /// go on round a loop there by itself.
    fn unsettled(&self, disturbed: &[bool]) -> Vec<(usize, u64)> {
        let until = |module: usize| match self.walker_of[module] {
            Some(walker) => self.walkers[walker].settled_at,
            None => u64::MAX,
        };
        let modules = (0..disturbed.len()).filter(|&module| disturbed[module]);
        modules.map(|module| (module, until(module))).collect()
    }

    /// Follows the modules that hormones reach now, of which some are disturbed.
    fn follow(&mut self, disturbed: &[bool], now: u64) {
        let mut before: Vec<Option<Walker>> = self.walker_of.iter().map(|_| None).collect();
        for walker in self.walkers.drain(..) {
            let module = walker.module;
            before[module] = Some(walker);
        }
        self.walker_of.fill(None);
        let doubted_until = self.orders.doubted_until();
        for (module, halted) in self.halted.iter_mut().enumerate() {
            let known = halted.filter(|_| !disturbed[module]);
            let heard = (DISCOVERY + disturbed.len() as u64 * HOP) as f64 * self.tries;
            let until = known.unwrap_or(now + self.period + heard as u64);
            let shall_stop = self.orders.gait(module).is_none() && self.wiring.has_power(module);
            *halted = shall_stop.then_some(until.max(doubted_until[module]));
        }
        for walker in before.iter().flatten().filter(|walker| walker.hops == 0) {
            self.led_until[walker.module] = Some(now);
        }
        // A module may have lost its lead by the change before, and not have found that out.
        let beats = |module: &usize| self.led_until[*module].is_some_and(|until| now <= until + DISCOVERY);
        let leads = |module: &usize| led_by(&self.wiring, &self.orders, *module) == Some(1);
        let leads_no_more: Vec<usize> =
            (0..before.len()).filter(beats).filter(|module| !leads(module)).collect();
        let ways = self.choose_ways(&leads_no_more, now);
        for (module, way) in ways.into_iter().enumerate() {
            let (Some(way), Some(gait)) = (way, self.orders.gait(module)) else { continue };
            let neighbours = self.wiring.neighbours(module);
            let known = before[module].take();
            let is_new = known.is_none();
            let mut walker = match known {
                Some(walker) => walker.changed(&neighbours, gait, way.hops),
                None => Walker::new(module, &neighbours, gait, way.hops),
            };
            if is_new || disturbed[module] {
                walker.disturbed(way.choices, now, self.tries);
            }
            walker.doubted(doubted_until[module]);
            self.walker_of[module] = Some(self.walkers.len());
            self.walkers.push(walker);
        }
        for walker in 0..self.walkers.len() {
            let Walker { module, .. } = self.walkers[walker];
            let other = other_leg(&self.wiring, module).and_then(|other| self.walker_of[other]);
            let is_leg = |number: &usize| self.walkers[*number].is_leg();
            self.walkers[walker].other = other.filter(|other| is_leg(&walker) && is_leg(other));
        }
    }

    /// The ways of hormones to all modules. A module has a choice if it may have to follow hormones that come
    /// by another dock than before. At power-up it follows none. One that led may beat once more where it is
    /// now, until it finds out, and its neighbours may follow that for a while.
    fn choose_ways(&mut self, leads_no_more: &[usize], now: u64) -> Vec<Option<Way>> {
        let mut has_choice = vec![false; self.ways.len()];
        for (module, since) in ways(&self.wiring, &self.orders).into_iter().enumerate() {
            // One that is cut off beats on by itself for a while, and follows what comes by the same dock.
            let beats_on = self.orders.gait(module).map_or(0, |gait| DISCOVERY + choice(&gait));
            let is_over = self.cut_off_at[module].is_some_and(|at| at + beats_on <= now);
            let before = if is_over { DockSet::EMPTY } else { self.ways[module] };
            has_choice[module] = now > 0 && before.union(since).iter().count() > 1;
            self.ways[module] = if since.is_empty() { before } else { since };
            let cut_off_at = self.cut_off_at[module].unwrap_or(now);
            self.cut_off_at[module] = since.is_empty().then_some(cut_off_at);
        }
        for peer in leads_no_more.iter().flat_map(|&module| self.wiring.peers(module)) {
            has_choice[peer] = true;
        }
        let mut ways = shortest_ways(&self.wiring, &self.orders, &has_choice);
        let choosing: Vec<usize> = (0..has_choice.len()).filter(|&module| has_choice[module]).collect();
        let is_behind = concerned(&self.wiring, &self.orders, &choosing);
        for (way, is_behind) in ways.iter_mut().zip(is_behind) {
            // Hormones may come by a longer way first.
            way.iter_mut().for_each(|way| way.choices = way.choices.max(is_behind.into()));
        }
        ways
    }

    /// The robot lies turned about its long axis from now on.
    pub fn turned(&mut self, now: u64) {
        self.turned_at = now;
        self.walkers.iter_mut().for_each(Walker::turned);
    }

    /// From `now` on a frame is sent so often until it and its ACK have arrived. A module that walks has to
    /// walk on.
    pub fn loses(&mut self, tries: f64, now: u64) {
        self.tries = tries;
        self.orders.loses(tries);
        for walker in &mut self.walkers {
            walker.loses(now, self.tries);
        }
    }

    /// From `now` on there are lines that lose or change what goes over them, or none.
    pub fn disturb_lines(&mut self, are_noisy: bool, now: u64) {
        if replace(&mut self.tally.is_noisy, are_noisy) != are_noisy {
            self.lines_since = now;
        }
    }

    /// Takes in the next trace event.
    pub fn take(&mut self, trace_event: &TraceEvent) {
        let &TraceEvent { cycle, module, event } = trace_event;
        let acts = !matches!(
            event,
            Event::TopologyChanged(_) | Event::HormoneDropped(_) | Event::ActionBegun(Action::Rest)
        );
        if acts && self.halted[module].is_some_and(|settled_at| cycle >= settled_at) {
            self.tally.count(Violation { at: cycle, module, wrong: Wrong::GoesOn });
        }
        let Some(number) = self.walker_of[module] else { return };
        self.look_for_apart(number, cycle);
        let (walker, tally) = (&mut self.walkers[number], &mut self.tally);
        match event {
            Event::HormoneGenerated(data) => {
                walker.take(cycle, Source::Timer, None, data, tally);
                self.look_for_another_leader(number, cycle);
            }
            Event::HormoneReceived(dock, data) => {
                walker.take(cycle, Source::Hormone, Some(dock), data, tally);
            }
            Event::MadeGood(data) => walker.take(cycle, Source::Hormone, None, data, tally),
            Event::HormoneSent(dock, data) => walker.send(cycle, dock, data, tally),
            Event::ActionBegun(action) => {
                walker.act(cycle, action, tally);
                self.beats += 1;
                self.measure_skew(number, cycle);
            }
            Event::TopologyChanged(_) | Event::HormoneDropped(_) => {}
        }
    }

    /// Looks at the present readings of the sensors that rules depend on.
    pub fn feel(&mut self, robot: &impl Robot) {
        let now = robot.now();
        for walker in &mut self.walkers {
            let read = |sense: Sense| value(sense.sensor(), robot.acceleration(walker.module)).unwrap_or(0);
            let values: Vec<i16> = walker.senses().map(read).collect();
            walker.feel(&values, (self.felt_at, now), self.turned_at);
        }
        self.felt_at = now;
    }

    /// Looks whether modules that have to do nothing rest: their joints may go on without any event.
    pub fn look_for_rest(&mut self, robot: &impl Robot) {
        let now = robot.now();
        for (module, halted) in self.halted.iter().enumerate() {
            let is_late = halted.is_some_and(|settled_at| now >= settled_at);
            let acts = |status: Status| status.action != Action::Rest;
            if is_late && robot.status(module).is_some_and(acts) {
                self.tally.count(Violation { at: now, module, wrong: Wrong::GoesOn });
            }
        }
    }

    /// Time has passed up to `now`.
    pub fn pass(&mut self, now: u64) {
        for number in 0..self.walkers.len() {
            self.walkers[number].pass(now, &mut self.tally);
            self.look_for_apart(number, now);
        }
    }

    /// Counts it as wrong if a module of a ring leads while another one does. Bad lines swallow the tokens by
    /// which leaders find each other out.
    fn look_for_another_leader(&mut self, number: usize, now: u64) {
        let walker = &self.walkers[number];
        let Some(size @ 2..) = led_by(&self.wiring, &self.orders, walker.module) else { return };
        if self.tally.is_noisy || now < self.lines_since + walker.patience(self.tries) {
            return;
        }
        let behind = |&module: &usize| Some(self.wiring.peer(Face { module, dock: Dock::Back })?.module);
        let others = successors(behind(&walker.module), behind).take(size as usize - 1);
        let walkers = others.filter_map(|module| Some(&self.walkers[self.walker_of[module]?]));
        let is_settled = |walker: &Walker| now >= walker.settled_at;
        if is_settled(walker) && walkers.into_iter().any(|other| is_settled(other) && other.leads(now)) {
            self.tally.count(Violation { at: now, module: walker.module, wrong: Wrong::Leads });
        }
    }

    fn measure_skew(&mut self, number: usize, now: u64) {
        let Walker { other, settled_at, .. } = self.walkers[number];
        let others = other.and_then(|other| self.walkers[other].step?.acted);
        let apart = others.map(|(acted_at, _)| now.abs_diff(acted_at));
        let apart = apart.filter(|&apart| apart <= self.walkers[number].half_beat() && now >= settled_at);
        self.skew_max = self.skew_max.max(apart);
    }

    /// Counts it as wrong if the last letters of both legs of a branch differ for longer than half a beat.
    fn look_for_apart(&mut self, number: usize, now: u64) {
        let Some(other) = self.walkers[number].other else { return };
        let [first, second] = [number.min(other), number.max(other)].map(|leg| &self.walkers[leg]);
        let (Some(one), Some(two)) = (first.step, second.step) else { return };
        let since = one.at.max(two.at);
        let found_at = since + first.half_beat();
        if one.data != two.data && now > found_at && first.apart_since != Some(since) {
            first.wrong(Wrong::Apart, found_at, &mut self.tally);
            self.walkers[number.min(other)].apart_since = Some(since);
        }
    }
}

/// The leg on the other side of the branch.
fn other_leg(wiring: &Wiring, leg: usize) -> Option<usize> {
    let at_branch = wiring.peer(Face { module: leg, dock: Dock::Back })?;
    let other_side = match at_branch.dock {
        Dock::Left => Dock::Right,
        Dock::Right => Dock::Left,
        _ => return None,
    };
    wiring.peer(Face { dock: other_side, ..at_branch }).map(|other| other.module)
}
