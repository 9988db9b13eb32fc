//! By which gait each body of a robot has to walk: the one that it was ordered last, whichever of its modules
//! heard the order. Bodies that join walk by the order that modules, which count orders, take for the newer
//! one. A body that has taken another shape walks by the gait that follows.

mod doubts;
mod telling;

use std::ops::Range;

use hormone::action::Action;
use hormone::gait::{Gait, GaitName, Once};
use hormone::period::Period;
use hormone::standing::Standing;
use hormone::status::Status;

use crate::hardware::MILLISECOND;
use crate::leader::{acting, leads};
use crate::walker::DISCOVERY;
use crate::wiring::{Face, Wiring};
use doubts::{Doubts, candidates, hearing};
use telling::Shown;

/// For how long a robot has to have the shape that its gait makes of it until it counts as reshaped: a
/// second, from when it has noticed.
const LASTS: u64 = 1_000 * MILLISECOND + DISCOVERY;

/// The order of a module that keeps none, or one for a gait that it does not have.
const POWER_UP: Standing = Standing::none(GaitName::Centipede as u8);

/// An order, or the gait that a module begins with.
#[derive(Clone, Copy)]
struct Order {
    /// Orders are numbered as they are given.
    number: u64,
    /// The order as modules keep it.
    standing: Standing,
}

/// A change of shape that has come to its end, if it lasts.
struct Reshaped {
    module: usize,
    /// The number of the order that it ends.
    order: u64,
    then: GaitName,
    at: u64,
}

/// When a robot that has taken another shape may walk by the gait that follows, but need not yet. It finds
/// out its shape sooner or later. If it has lost the shape again, it may have found out before.
struct Choice {
    /// The number of the order that it ends.
    order: u64,
    then: GaitName,
    between: Range<u64>,
}

/// The orders that modules have to follow.
pub struct Orders {
    /// By module.
    of: Vec<Order>,
    given: u64,
    /// Modules that start over, and when their programs run again. Until then they hear of no order.
    restarting: Vec<(usize, u64)>,
    reshaped: Vec<Reshaped>,
    choices: Vec<Choice>,
    /// Orders of what was ordered already: to which module, and until when they may come to it. One that
    /// comes after another order is a new one.
    again: Vec<(usize, (u8, Period), u64)>,
    doubts: Doubts,
}

impl Orders {
    /// So many modules at power-up: they begin with the centipede's gait.
    pub fn new(modules: usize) -> Self {
        let first = Order { number: 0, standing: POWER_UP };
        let of = vec![first; modules];
        Orders {
            of,
            given: 0,
            restarting: Vec::new(),
            reshaped: Vec::new(),
            choices: Vec::new(),
            again: Vec::new(),
            doubts: Doubts::default(),
        }
    }

    /// The gait that a module has to walk by; `None` if it was ordered to stop, or to walk by a gait that it
    /// does not have.
    pub fn gait(&self, module: usize) -> Option<Gait> {
        self.of[module].gait()
    }

    /// The body of a module is ordered to walk by the gait of this name in this Period, or to stop. Returns
    /// the modules to which that is new.
    pub fn give(
        &mut self,
        wiring: &Wiring,
        module: usize,
        (gait, period): (u8, Period),
        now: u64,
    ) -> Vec<usize> {
        self.again.retain(|&(.., until)| now <= until);
        let Some(standing) = self.of[module].standing.next(gait, period) else {
            self.again.push((module, (gait, period), now + doubts::COMING));
            return Vec::new();
        };
        self.given += 1;
        let order = Order { number: self.given, standing };
        let body = hearing(wiring, module);
        let stood = self.newest(&body).unwrap_or(self.of[module]);
        let apart = self.doubts.given(&self.of, wiring, (module, order), now);
        let mut known = self.doubts.known(module);
        // One that starts over hears it once it runs, and may have heard of the order of its body by then.
        known.extend(self.restarting.extract_if(.., |&mut (other, _)| other == module).map(|_| stood));
        let before = std::mem::replace(&mut self.of[module], order);
        let mut changed = self.spread(wiring);
        for known in known {
            let Some(standing) = known.standing.next(gait, period) else { continue };
            let instead = stood.newer(Order { standing, ..order });
            self.doubts.open(wiring, module, self.of[module], vec![instead; self.of.len()].into(), now);
        }
        let again = self.again.iter().filter(|(other, ..)| body.contains(other));
        for standing in again.filter_map(|&(_, (gait, period), _)| order.standing.next(gait, period)) {
            let instead = vec![Order { standing, ..order }; self.of.len()];
            self.doubts.open(wiring, module, self.of[module], instead.into(), now);
        }
        changed.extend((!before.is_like(order)).then_some(module));
        changed.extend(apart);
        // The body may already have the shape that the gait makes of it. If it walked by the gait that
        // follows, it seems to walk on until all its modules have heard the order.
        self.look(wiring, now, now + DISCOVERY);
        changed
    }

    /// Takes in a changed wiring, and that from before: bodies that joined go on by the newer order. Returns
    /// the modules that walk by another gait than before.
    pub fn rewired(&mut self, before: &Wiring, wiring: &Wiring, now: u64) -> Vec<usize> {
        self.doubts.rewired(&self.of, (before, wiring), now);
        self.join(wiring, now)
    }

    /// Has bodies go on by the newest order in them. Returns the modules that walk by another gait than
    /// before.
    fn join(&mut self, wiring: &Wiring, now: u64) -> Vec<usize> {
        let changed = self.spread(wiring);
        self.look(wiring, now, now);
        changed
    }

    /// From now on a frame is sent so often until it and its ACK have arrived.
    pub fn loses(&mut self, tries: f64) {
        self.doubts.loses(tries);
    }

    /// Whether a dock, to which nothing is attached, may miss what comes in by `now`.
    pub fn may_miss(&self, face: Face, now: u64) -> bool {
        self.doubts.may_miss(face, now)
    }

    /// An order that comes to a module may be lost.
    pub fn interrupted(&mut self, wiring: &Wiring, module: usize, now: u64) {
        self.doubts.interrupted(&self.of, wiring, module, now);
    }

    /// A module starts over, and runs again from `runs_at` on: it recalls its order, and takes that for older
    /// than orders that others were given since their power-up.
    pub fn restarted(&mut self, module: usize, runs_at: u64) {
        let standing = &mut self.of[module].standing;
        *standing = Standing::from_record(standing.to_record()).unwrap_or(POWER_UP);
        self.restarting.retain(|&(other, _)| other != module);
        self.restarting.push((module, runs_at));
    }

    /// Checks which bodies have the shape that their gait makes of them. Those that have it newly may walk on
    /// from `first` on.
    fn look(&mut self, wiring: &Wiring, now: u64, first: u64) {
        let waiting = std::mem::take(&mut self.reshaped);
        for body in wiring.bodies() {
            let then = |&module: &usize| Some((module, then(wiring, module, &self.gait(module)?)?));
            let Some((module, then)) = body.iter().find_map(then) else { continue };
            let order = self.of[module].number;
            let known = waiting.iter().find(|it| it.order == order && body.contains(&it.module));
            let at = known.map_or(now + LASTS, |it| it.at);
            if known.is_none() {
                self.choices.push(Choice { order, then, between: first..at + DISCOVERY });
            }
            self.reshaped.push(Reshaped { module, order, then, at });
        }
    }

    /// When a robot will have taken another shape, or a module runs again, if nothing happens before.
    pub fn next(&self) -> Option<u64> {
        let runs_at = self.restarting.iter().map(|&(_, runs_at)| runs_at);
        self.reshaped.iter().map(|reshaped| reshaped.at).chain(runs_at).min()
    }

    /// Has modules that run again by `now` hear what others were ordered, and the bodies that have taken
    /// another shape by then walk by the gait that follows, if they have not been ordered otherwise
    /// meanwhile. Returns the modules to which that is new.
    pub fn settle(&mut self, wiring: &Wiring, now: u64) -> Vec<usize> {
        let mut changed = Vec::new();
        if self.restarting.extract_if(.., |&mut (_, runs_at)| runs_at <= now).count() > 0 {
            changed = self.join(wiring, now);
        }
        let mut over: Vec<Reshaped> = self.reshaped.extract_if(.., |reshaped| reshaped.at <= now).collect();
        over.retain(|reshaped| self.of[reshaped.module].number == reshaped.order);
        for Reshaped { module, then, .. } in over {
            changed.extend(self.walk_on(wiring, module, then, now));
        }
        changed
    }

    /// Until when modules may follow one order or another, by module.
    pub fn doubted_until(&self) -> Vec<u64> {
        self.doubts.until(self.of.len())
    }

    /// Has bodies that may walk on do so by `now` if one of their modules says that it walks by the gait that
    /// follows, and settles doubts. `beat` is how long a module's last beat took, in cycles. Returns the
    /// modules to which that is new.
    pub fn choose(
        &mut self,
        wiring: &Wiring,
        now: u64,
        status: impl Fn(usize) -> Option<Status>,
        beat: impl Fn(usize) -> Option<u64>,
    ) -> Vec<usize> {
        let says = |module: usize| status(module).map(|status| status.gait);
        let acts = |module: usize| status(module).is_some_and(|status| status.action != Action::Rest);
        self.choices.retain(|choice| now < choice.between.end);
        let mut changed = Vec::new();
        let due = self.doubts.due(now);
        let bodies = if due.is_empty() { Vec::new() } else { wiring.bodies() };
        for body in bodies {
            let is_doubted = |it: &&usize| due.iter().any(|doubt| doubt.is_about(**it, self.of[**it].number));
            let Some(&module) = body.iter().find(is_doubted) else { continue };
            let order = self.of[module].number;
            // One that started over had another order before than the rest of its body.
            let with_it: Vec<usize> =
                body.iter().copied().filter(|&it| self.of[it].number == order).collect();
            let orders = candidates(&due, &with_it, self.of[module]);
            let shown = Shown {
                says: says(module),
                acts: body.iter().any(|&it| acts(it)),
                beat: beat(module).or_else(|| body.iter().find_map(|&it| beat(it))),
            };
            let is_led = |gait: &Gait| body.iter().any(|&it| leads(wiring, it, gait.leader).is_some());
            let then = |gait: &Gait| body.iter().find_map(|&it| then(wiring, it, gait)).map(GaitName::gait);
            let follows = shown.tells(&orders, is_led, then);
            if follows > 0 {
                with_it.iter().for_each(|&it| self.of[it] = orders[follows]);
                changed.extend(with_it);
                changed.extend(self.spread(wiring));
                // A body that was to rest has shown no pace.
                let is_open = |it: &&Order| shown.beat.is_none() && orders[follows].differs_in_pace(**it);
                for instead in orders.iter().filter(is_open) {
                    let instead = vec![*instead; self.of.len()].into();
                    self.doubts.open(wiring, module, orders[follows], instead, now);
                }
            }
        }
        if self.choices.is_empty() {
            return changed;
        }
        for module in 0..self.of.len() {
            let order = self.of[module].number;
            let is_its = |choice: &&Choice| choice.order == order && choice.between.contains(&now);
            let then = self.choices.iter().find(is_its).map(|choice| choice.then);
            if let Some(then) = then.filter(|&then| says(module) == Some(then as u8)) {
                changed.extend(self.walk_on(wiring, module, then, now));
            }
        }
        changed
    }

    /// The body of a module walks by the gait that follows its order. What may count instead of the order may
    /// do so instead of that gait. Returns the modules to which that is new.
    fn walk_on(&mut self, wiring: &Wiring, module: usize, then: GaitName, now: u64) -> Vec<usize> {
        let instead = self.doubts.instead_of(module, self.of[module].number);
        let changed = self.give(wiring, module, (then as u8, Period::OWN), now);
        let order = self.of[module];
        instead.into_iter().for_each(|instead| self.doubts.open(wiring, module, order, instead, now));
        changed
    }

    /// The newest order that any module of a body has, but for those that start over.
    fn newest(&self, body: &[usize]) -> Option<Order> {
        let hearing = body.iter().filter(|&&module| self.hears(module));
        hearing.map(|&module| self.of[module]).reduce(Order::newer)
    }

    fn hears(&self, module: usize) -> bool {
        self.restarting.iter().all(|&(other, _)| other != module)
    }

    /// Has all modules of a body follow the newest order that any of them has. Returns the modules that walk
    /// by another gait now.
    fn spread(&mut self, wiring: &Wiring) -> Vec<usize> {
        let mut changed = Vec::new();
        for body in wiring.bodies() {
            let Some(newest) = self.newest(&body) else { continue };
            for module in body {
                if !self.hears(module) {
                    continue;
                }
                let before = std::mem::replace(&mut self.of[module], newest);
                changed.extend((!before.is_like(newest)).then_some(module));
            }
        }
        changed
    }
}

impl Order {
    /// The gait that is ordered; `None` to stop.
    fn gait(self) -> Option<Gait> {
        let Standing { gait, period, .. } = self.standing;
        Some(period.of(GaitName::from_byte(gait)?.gait()))
    }

    /// The one of both that modules take for the newer one.
    fn newer(self, other: Order) -> Order {
        if other.standing == self.standing {
            return if other.number > self.number { other } else { self };
        }
        if other.standing.supersedes(self.standing) { other } else { self }
    }

    /// Whether both ask for the same.
    fn is_like(self, other: Order) -> bool {
        let what = |order: Order| order.gait().map(|gait| (gait.name, gait.beat));
        what(self) == what(other)
    }

    /// Whether both ask for the same gait in different Periods.
    fn differs_in_pace(self, other: Order) -> bool {
        let gaits = self.gait().zip(other.gait());
        gaits.is_some_and(|(one, other)| one.name == other.name && one.beat != other.beat)
    }
}

/// How long a beat of this gait is, in cycles.
fn beat(gait: &Gait) -> u64 {
    u64::from(gait.beat.get()) * MILLISECOND
}

/// The gait that follows this one, for a module that has the type in which it ends, and leads by the other.
fn then(wiring: &Wiring, module: usize, gait: &Gait) -> Option<GaitName> {
    let Once { becomes, then } = gait.once?;
    let is_there = acting(wiring, module) == becomes && leads(wiring, module, then.gait().leader).is_some();
    is_there.then_some(then)
}

#[cfg(test)]
pub mod tests {
    use hormone::gait::GaitName::{Caterpillar, CloseRing, OpenRing, RollingTrack};
    use hormone::standing::STOP;
    use tasks::dock::Dock::Back;

    use super::*;
    use crate::shape::Shape;

    /// What a module says that walks by a gait.
    pub fn walking(gait: GaitName) -> Status {
        Status { gait: gait as u8, action: Action::Straight, ..Status::POWER_UP }
    }

    fn ordered(wiring: &Wiring, gait: GaitName) -> Orders {
        let mut orders = Orders::new(wiring.modules());
        orders.give(wiring, 0, (gait as u8, Period::OWN), 0);
        orders
    }

    #[test]
    fn a_robot_that_has_the_shape_already_has_to_walk_on_once_that_has_lasted() {
        for (shape, ordered_to, then) in [
            (Shape::Ring, CloseRing, RollingTrack),
            (Shape::Chain, OpenRing, Caterpillar),
            (Shape::Ring, OpenRing, OpenRing),
            (Shape::Chain, CloseRing, CloseRing),
            (Shape::Centipede, CloseRing, CloseRing),
        ] {
            let wiring = shape.wiring(6).unwrap();
            let mut orders = ordered(&wiring, ordered_to);
            orders.settle(&wiring, LASTS - 1);
            let name = |orders: &Orders| orders.gait(5).and_then(|gait| GaitName::from_byte(gait.name));
            assert_eq!(name(&orders), Some(ordered_to), "{shape:?}");
            orders.settle(&wiring, LASTS);
            assert_eq!(name(&orders), Some(then), "{shape:?}");
        }
    }

    #[test]
    fn a_robot_that_says_that_it_walks_on_may_do_so_while_it_has_the_choice_and_no_longer() {
        let chain = Shape::Chain.wiring(6).unwrap();
        let ring = Shape::Ring.wiring(6).unwrap();
        let is_taken = |orders: &mut Orders, wiring: &Wiring, now: u64, said: GaitName| {
            orders.settle(wiring, now);
            !orders.choose(wiring, now, |module| (module == 2).then(|| walking(said)), |_| None).is_empty()
        };
        let closed_at = 10 * LASTS;
        for (opened_at, now, said, is_right) in [
            // It has not closed yet.
            (None, closed_at - 1, RollingTrack, false),
            (None, closed_at, RollingTrack, true),
            (None, closed_at, Caterpillar, false),
            (None, closed_at + LASTS - 1, RollingTrack, true),
            // It may have found out before it came apart.
            (Some(closed_at + 1), closed_at + 2, RollingTrack, true),
            (Some(closed_at + LASTS - 1), closed_at + LASTS + DISCOVERY - 1, RollingTrack, true),
            (Some(closed_at + 1), closed_at + LASTS + DISCOVERY, RollingTrack, false),
        ] {
            let mut orders = ordered(&chain, CloseRing);
            let mut wiring = &chain;
            for (at, next) in [(Some(closed_at), &ring), (opened_at, &chain)] {
                if at.is_some_and(|at| at <= now) {
                    orders.rewired(wiring, next, at.unwrap_or_default());
                    wiring = next;
                }
            }
            assert_eq!(is_taken(&mut orders, wiring, now, said), is_right, "{opened_at:?} {now} {said:?}");
        }
        // A module that has not heard the order yet goes on as before.
        for (now, is_right) in [(DISCOVERY - 1, false), (DISCOVERY, true)] {
            assert_eq!(is_taken(&mut ordered(&ring, CloseRing), &ring, now, RollingTrack), is_right);
        }
    }

    #[test]
    fn bodies_that_join_walk_by_the_order_of_the_one_that_was_ordered_more_often() {
        let whole = Shape::Chain.wiring(6).unwrap();
        let mut cut = whole.clone();
        cut.detach(Face { module: 2, dock: Back }).unwrap();
        for (orders_given, joined) in [
            (&[(0, Some(Caterpillar)), (5, Some(RollingTrack)), (0, Some(OpenRing))][..], Some(OpenRing)),
            (&[(0, Some(Caterpillar)), (0, Some(OpenRing)), (5, Some(RollingTrack))], Some(OpenRing)),
            // An order to stop counts as several, and one that stands already as none.
            (&[(0, None), (5, Some(Caterpillar)), (5, Some(RollingTrack))], None),
            (&[(0, Some(Caterpillar)), (0, Some(Caterpillar)), (5, None), (5, None)], None),
            // If both were ordered equally often, it is one of both.
            (&[(0, Some(Caterpillar)), (5, Some(RollingTrack))], Some(RollingTrack)),
            (&[(5, Some(RollingTrack)), (0, Some(Caterpillar))], Some(RollingTrack)),
            (&[(5, Some(RollingTrack))], Some(RollingTrack)),
        ] {
            let mut orders = Orders::new(6);
            for &(module, gait) in orders_given {
                orders.give(&cut, module, (gait.map_or(STOP, |gait| gait as u8), Period::OWN), 0);
            }
            orders.rewired(&cut, &whole, 1);
            for module in 0..6 {
                let gait = orders.gait(module).and_then(|gait| GaitName::from_byte(gait.name));
                assert_eq!(gait, joined, "{orders_given:?}");
            }
        }
    }

    /// Both parts are ordered, the first one more often, and modules of it start over together.
    #[test]
    fn what_all_modules_of_a_body_recall_is_older_than_what_others_were_ordered() {
        let whole = Shape::Chain.wiring(6).unwrap();
        let mut cut = whole.clone();
        cut.detach(Face { module: 2, dock: Back }).unwrap();
        for (restarted, joined) in [(0..0, OpenRing), (0..2, OpenRing), (0..3, RollingTrack)] {
            let mut orders = Orders::new(6);
            for (module, gait) in [(0, Caterpillar), (0, OpenRing), (5, RollingTrack)] {
                orders.give(&cut, module, (gait as u8, Period::OWN), 0);
            }
            for module in restarted {
                orders.rewired(&cut, &cut, 1);
                orders.restarted(module, 3);
            }
            orders.settle(&cut, 2);
            orders.settle(&cut, 3);
            orders.rewired(&cut, &whole, 4);
            for module in 0..6 {
                let gait = orders.gait(module).and_then(|gait| GaitName::from_byte(gait.name));
                assert_eq!(gait, Some(joined), "{module}");
            }
        }
    }

    #[test]
    fn all_parts_of_a_ring_that_opens_have_to_walk_on() {
        let mut wiring = Shape::Ring.wiring(6).unwrap();
        let mut orders = ordered(&wiring, OpenRing);
        for (module, at) in [(0, 0), (3, 10)] {
            let before = wiring.clone();
            wiring.detach(Face { module, dock: Back }).unwrap();
            orders.rewired(&before, &wiring, at);
        }
        let name =
            |orders: &Orders, module| orders.gait(module).and_then(|gait| GaitName::from_byte(gait.name));
        for (at, gaits) in [(LASTS, [Caterpillar, OpenRing]), (LASTS + 10, [Caterpillar, Caterpillar])] {
            orders.settle(&wiring, at);
            assert_eq!([1, 4].map(|module| name(&orders, module)), gaits.map(Some), "{at}");
        }
    }
}
