//! Bodies of which nobody outside knows which of two orders they follow. A link may fail while an order is on
//! its way. Two modules may be ordered at once. A module may be ordered before it knows the order of the body
//! that it has joined.

use std::sync::Arc;

use super::{Order, beat};
use crate::command::SENDS;
use crate::hardware::{GIVEN_UP_AFTER, STEP};
use crate::walker::{DISCOVERY, HOP, election};
use crate::wiring::{Face, Wiring};

/// How long a module may not have heard an order: a remote control repeats it, and a dock may hear only the
/// last sending.
pub const COMING: u64 = SENDS[SENDS.len() - 1] + GIVEN_UP_AFTER;

/// An order on its way from the module to which it was given.
struct Spreading {
    module: usize,
    /// Its number.
    order: u64,
    /// By module, the order before.
    before: Arc<[Order]>,
    given_at: u64,
    until: u64,
}

/// A body follows an order, or another one counts instead.
pub struct Doubt {
    /// The modules that heard each other when it arose.
    body: Vec<usize>,
    /// The number of the order.
    order: u64,
    /// By module, what counts instead.
    instead: Arc<[Order]>,
    since: u64,
    /// When what the modules do tells which.
    at: u64,
}

/// Finds out where there is a doubt.
pub struct Doubts {
    spreading: Vec<Spreading>,
    before: Vec<Before>,
    open: Vec<Doubt>,
    /// How often a frame is sent until it and its ACK have arrived.
    tries: f64,
}

/// What was before a change. Modules may not notice that until this time, and may hear each other as before:
/// a link may fail in one direction.
struct Before {
    wiring: Wiring,
    /// By module.
    orders: Arc<[Order]>,
    until: u64,
}

impl Default for Doubts {
    fn default() -> Self {
        Doubts { spreading: Vec::new(), before: Vec::new(), open: Vec::new(), tries: 1.0 }
    }
}

impl Doubts {
    /// From now on a frame is sent so often until it and its ACK have arrived, and what opens takes longer.
    pub fn loses(&mut self, tries: f64) {
        self.tries = tries;
    }

    /// A module is given an order, while modules have the orders `of`. Returns the modules of other bodies
    /// that may hear of it all the same.
    pub fn given(
        &mut self,
        of: &[Order],
        wiring: &Wiring,
        (module, order): (usize, Order),
        now: u64,
    ) -> Vec<usize> {
        self.forget(now);
        let known = of[module].number;
        let is_other = |it: &Spreading| it.order == known && (it.module != module || it.is_coming(now));
        if self.spreading.iter().any(is_other) {
            self.open(wiring, module, order, of.into(), now);
        } else {
            // What may count instead of the order before may do so instead of this one.
            let is_fresh = |it: &&Doubt| it.is_about(module, known) && now < it.since + DISCOVERY;
            let fresh: Vec<_> = self.open.iter().filter(is_fresh).map(|it| Arc::clone(&it.instead)).collect();
            fresh.into_iter().for_each(|instead| self.open(wiring, module, order, instead, now));
        }
        let mut is_apart = vec![false; of.len()];
        for before in &self.before {
            hearing(&before.wiring, module).into_iter().for_each(|it| is_apart[it] = true);
        }
        hearing(wiring, module).into_iter().for_each(|it| is_apart[it] = false);
        let instead: Arc<[Order]> = vec![order; of.len()].into();
        for body in wiring.bodies() {
            if let Some(other) = body.into_iter().find(|&it| is_apart[it]) {
                self.open(wiring, other, of[other], Arc::clone(&instead), now);
            }
        }
        let until = now + DISCOVERY + of.len() as u64 * HOP;
        let (order, before) = (order.number, of.into());
        self.spreading.push(Spreading { module, order, before, given_at: now, until });
        (0..of.len()).filter(|&it| is_apart[it]).collect()
    }

    /// Whether a dock, to which nothing is attached, may miss what comes in by `now`: until its module has
    /// noticed that something came off, the dock sends.
    pub fn may_miss(&self, face: Face, now: u64) -> bool {
        self.before.iter().any(|before| now < before.until && before.wiring.attached(face).is_some())
    }

    /// An order that comes to a module may be lost, while modules have the orders `of`.
    pub fn interrupted(&mut self, of: &[Order], wiring: &Wiring, module: usize, now: u64) {
        self.forget(now);
        let is_lost = |it: &&Spreading| it.module == module && it.is_coming(now);
        let lost: Vec<_> =
            self.spreading.iter().filter(is_lost).map(|it| (it.order, Arc::clone(&it.before))).collect();
        for (order, before) in lost {
            if of[module].number == order {
                self.open(wiring, module, of[module], before, now);
            }
        }
    }

    /// Takes in a changed wiring, before modules with the orders `of` hear each other by it: those that are
    /// cut off from an order may not have heard of it, nor of the one before.
    pub fn rewired(&mut self, of: &[Order], (before, wiring): (&Wiring, &Wiring), now: u64) {
        self.forget(now);
        self.before.push(Before { wiring: before.clone(), orders: of.into(), until: now + DISCOVERY });
        // What the modules do tells later which order they follow, as they have to find out the change first.
        let changed = before.differences(wiring);
        for doubt in self.open.iter_mut().filter(|it| changed.iter().any(|module| it.body.contains(module))) {
            doubt.at = doubt.at.max(now + (doubt.at - doubt.since));
        }
        if self.spreading.is_empty() && self.open.is_empty() {
            return;
        }
        for body in wiring.bodies() {
            let modules = one_by_order(of, &body);
            for &module in &modules {
                let mut order = of[module];
                let mut cut_off = Vec::new();
                for it in self.spreading.iter().rev().filter(|it| !body.contains(&it.module)) {
                    if it.order == order.number {
                        cut_off.push((order, Arc::clone(&it.before)));
                        order = it.before[module];
                    }
                }
                for (order, before) in cut_off {
                    self.open(wiring, module, order, before, now);
                }
            }
            self.joined(of, wiring, &modules, now);
        }
    }

    /// These modules, each with an order of its own, are of one body now. Which of their orders is the newest
    /// depends on which of them follows another one.
    fn joined(&mut self, of: &[Order], wiring: &Wiring, modules: &[usize], now: u64) {
        let newest = |except| {
            let others = modules.iter().filter(|&&module| Some(module) != except);
            others.map(|&module| of[module]).reduce(Order::newer)
        };
        let Some(counts) = newest(None) else { return };
        for &module in modules {
            let Some(others) = newest(Some(module)) else { return };
            for follows in candidates(&self.open, &[module], of[module]) {
                let instead = follows.newer(others);
                if !instead.is_like(counts) {
                    self.open(wiring, module, counts, vec![instead; of.len()].into(), now);
                }
            }
        }
    }

    /// The orders that a module may still follow, where it has joined a body with another.
    pub fn known(&self, module: usize) -> Vec<Order> {
        self.before.iter().map(|before| before.orders[module]).collect()
    }

    /// By module, what may count instead of an order of this one's body.
    pub fn instead_of(&self, module: usize, order: u64) -> Vec<Arc<[Order]>> {
        let open = self.open.iter().filter(|doubt| doubt.is_about(module, order));
        open.map(|doubt| Arc::clone(&doubt.instead)).collect()
    }

    /// The doubts that are to be settled by `now`.
    pub fn due(&mut self, now: u64) -> Vec<Doubt> {
        self.open.extract_if(.., |doubt| doubt.at <= now).collect()
    }

    /// Until when modules may follow one order or another, and since when not to know that is no fault of the
    /// modules: what they do is looked at once in a while.
    pub fn until(&self, modules: usize) -> Vec<u64> {
        let mut until = vec![0; modules];
        for doubt in self.open.iter().filter(|doubt| doubt.at > doubt.since) {
            for &module in &doubt.body {
                until[module] = until[module].max(doubt.at + STEP);
            }
        }
        until
    }

    /// The body of a module follows an order, or another one. A doubt about the other one is settled with
    /// this one.
    pub fn open(&mut self, wiring: &Wiring, module: usize, order: Order, instead: Arc<[Order]>, now: u64) {
        let body = hearing(wiring, module);
        self.open.push(Doubt { body, order: order.number, instead, since: now, at: now });
        let orders = candidates(&self.open, &[module], order);
        let pairs = orders.iter().flat_map(|one| orders.iter().map(|other| one.shows_after(*other)));
        let Some(shows_after) = pairs.flatten().max() else { return };
        let at = now + (DISCOVERY as f64 * self.tries) as u64 + shows_after;
        for doubt in &mut self.open {
            if orders.iter().any(|order| doubt.is_about(module, order.number)) {
                doubt.at = doubt.at.max(at);
            }
        }
    }

    fn forget(&mut self, now: u64) {
        self.spreading.retain(|spreading| now < spreading.until);
        self.before.retain(|before| now < before.until);
    }
}

impl Spreading {
    /// Whether the module may not have heard it yet.
    fn is_coming(&self, now: u64) -> bool {
        now <= self.given_at + COMING
    }
}

impl Doubt {
    pub fn is_about(&self, module: usize, order: u64) -> bool {
        self.order == order && self.body.contains(&module)
    }
}

impl Order {
    /// How long it takes, once all modules have heard, until what they do tells this order from another;
    /// `None` if nothing does. The gait's name shows at once, whether any module acts at the first beat of
    /// the leader, which a ring has to elect, and the Period by two letters.
    fn shows_after(self, other: Order) -> Option<u64> {
        match (self.gait(), other.gait()) {
            (Some(one), Some(other)) if one.name != other.name => Some(0),
            (Some(one), Some(other)) if one.beat != other.beat => Some(2 * beat(&one).max(beat(&other))),
            (Some(gait), None) | (None, Some(gait)) => Some(beat(&gait) + election(gait.leader)),
            _ => None,
        }
    }
}

/// More orders than that are not told apart: the oldest ones count no more.
const MOST: usize = 32;

/// The orders that these modules of a body may follow by these doubts, and first this one, which counts else.
pub fn candidates(doubts: &[Doubt], modules: &[usize], order: Order) -> Vec<Order> {
    let mut orders = vec![order];
    let mut seen = 0;
    while let Some(&order) = orders.get(seen) {
        let instead = |module: usize| {
            let about = doubts.iter().filter(move |doubt| doubt.is_about(module, order.number));
            about.map(move |doubt| doubt.instead[module])
        };
        for instead in modules.iter().flat_map(|&module| instead(module)) {
            let is_known = |it: &Order| (it.number, it.standing) == (instead.number, instead.standing);
            if orders.len() < MOST && !orders.iter().any(is_known) {
                orders.push(instead);
            }
        }
        seen += 1;
    }
    orders
}

/// Of these modules one for each order that they have.
fn one_by_order(of: &[Order], modules: &[usize]) -> Vec<usize> {
    let mut found: Vec<usize> = Vec::new();
    for &module in modules {
        if found.iter().all(|&other| of[other].number != of[module].number) {
            found.push(module);
        }
    }
    found
}

/// The modules that hear this one, directly or by way of others.
pub fn hearing(wiring: &Wiring, module: usize) -> Vec<usize> {
    wiring.bodies().into_iter().find(|body| body.contains(&module)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use hormone::action::Action;
    use hormone::gait::GaitName::{
        self, Caterpillar, Centipede, OpenRing, RollingTrack, Serpentine, SixLegs,
    };
    use hormone::gait::Leader;
    use hormone::period::Period;
    use hormone::standing::STOP;
    use hormone::status::Status;
    use tasks::dock::Dock::Back;

    use super::super::tests::walking;
    use super::super::{LASTS, Orders};
    use super::*;
    use crate::shape::Shape;

    const AT: u64 = 10 * DISCOVERY;

    /// The gaits of modules 1 and 4 of a chain that may be cut between modules 2 and 3, and whose modules are
    /// ordered at these times. In the end all say that they walk by `said`.
    fn gaits(cut_at: Option<u64>, ordered: &[(usize, GaitName, u64)], said: GaitName) -> [Option<u8>; 2] {
        let whole = Shape::Chain.wiring(6).unwrap();
        let mut cut = whole.clone();
        cut.detach(Face { module: 2, dock: Back }).unwrap();
        let mut orders = Orders::new(6);
        let mut wiring = &whole;
        let mut events: Vec<_> =
            ordered.iter().map(|&(module, gait, at)| (at, Some((module, gait)))).collect();
        events.extend(cut_at.map(|at| (at, None)));
        events.sort_by_key(|&(at, _)| at);
        for (at, order) in events {
            if let Some((module, gait)) = order {
                orders.give(wiring, module, (gait as u8, Period::OWN), at);
            } else {
                orders.rewired(wiring, &cut, at);
                wiring = &cut;
            }
        }
        assert!(
            orders.choose(wiring, AT + DISCOVERY - 1, |_| Some(walking(said)), |_| None).is_empty(),
            "too soon"
        );
        orders.choose(wiring, AT + 2 * DISCOVERY, |_| Some(walking(said)), |_| None);
        [1, 4].map(|module| orders.gait(module).map(|gait| gait.name))
    }

    #[test]
    fn a_body_that_is_cut_off_meanwhile_may_have_heard_an_order_or_not() {
        let order = [(0, Caterpillar, AT)];
        let [walks, told] = [Some(Centipede as u8), Some(Caterpillar as u8)];
        for (cut_at, said, rear) in [
            (AT + 1, Centipede, walks),
            (AT + 1, Caterpillar, told),
            (AT + 1, Serpentine, told),
            (AT - 1, Centipede, walks),
            (AT - 1, Caterpillar, told),
            (AT - DISCOVERY, Caterpillar, walks),
        ] {
            assert_eq!(gaits(Some(cut_at), &order, said), [told, rear], "{cut_at} {said:?}");
        }
        // By then it was everywhere.
        assert_eq!(gaits(Some(AT), &[(0, Caterpillar, AT - 2 * DISCOVERY)], Centipede), [told, told]);
    }

    /// It had not heard the order yet, or not passed it on. Where another module starts over all others have.
    #[test]
    fn an_order_may_be_lost_only_where_the_ordered_module_starts_over_soon() {
        let chain = Shape::Chain.wiring(6).unwrap();
        for (module, after, counts) in
            [(0, 1, Centipede), (0, COMING, Centipede), (0, COMING + 1, Caterpillar), (3, 1, Caterpillar)]
        {
            let mut orders = Orders::new(6);
            orders.give(&chain, 0, (Caterpillar as u8, Period::OWN), AT);
            orders.interrupted(&chain, module, AT + after);
            orders.choose(&chain, AT + 2 * DISCOVERY, |_| Some(walking(Centipede)), |_| None);
            let named = [0, 5].map(|module| orders.gait(module).map(|gait| gait.name));
            assert_eq!(named, [Some(counts as u8); 2], "{module} {after}");
        }
    }

    #[test]
    fn of_two_orders_at_once_either_may_count() {
        for (apart, said, counts) in [
            (DISCOVERY / 2, Caterpillar, Caterpillar),
            (DISCOVERY / 2, Serpentine, Serpentine),
            (DISCOVERY / 2, Centipede, Serpentine),
            (2 * DISCOVERY, Caterpillar, Serpentine),
        ] {
            let ordered = [(0, Caterpillar, AT - apart), (5, Serpentine, AT)];
            assert_eq!(gaits(None, &ordered, said), [Some(counts as u8); 2], "{apart} {said:?}");
        }
    }

    #[test]
    fn of_three_orders_at_once_any_may_count() {
        for (said, counts) in
            [(Caterpillar, Caterpillar), (Serpentine, Serpentine), (SixLegs, SixLegs), (Centipede, SixLegs)]
        {
            let ordered = [(0, Caterpillar, AT - 2), (5, Serpentine, AT - 1), (2, SixLegs, AT)];
            assert_eq!(gaits(None, &ordered, said), [Some(counts as u8); 2], "{said:?}");
        }
    }

    #[test]
    fn a_body_that_is_cut_off_may_have_heard_neither_of_two_orders() {
        for said in [Centipede, Caterpillar, Serpentine] {
            let ordered = [(0, Caterpillar, AT - DISCOVERY / 2), (0, Serpentine, AT)];
            let told = Some(Serpentine as u8);
            assert_eq!(gaits(Some(AT + 1), &ordered, said), [told, Some(said as u8)], "{said:?}");
        }
    }

    #[test]
    fn of_two_orders_of_one_gait_the_pace_tells_which_counts() {
        let chain = Shape::Chain.wiring(6).unwrap();
        let long = Period::of_milliseconds(4000).unwrap();
        let [own, longer] = [Period::OWN, long].map(|period| beat(&period.of(Serpentine.gait())));
        for (first, second) in [(long, Period::OWN), (Period::OWN, long)] {
            for beat in [own, longer] {
                let mut orders = Orders::new(6);
                orders.give(&chain, 0, (Serpentine as u8, first), AT);
                orders.give(&chain, 5, (Serpentine as u8, second), AT + 1);
                let due = AT + 1 + DISCOVERY + 2 * longer;
                let says = |_| Some(walking(Serpentine));
                assert!(orders.choose(&chain, due - 1, says, |_| Some(beat)).is_empty(), "too soon");
                assert!(orders.doubted_until().iter().all(|&until| until >= due + STEP));
                orders.choose(&chain, due, says, |_| Some(beat + beat / 9));
                let counts = orders.gait(3).map(|gait| super::beat(&gait));
                assert_eq!(counts, Some(beat), "{first:?} {second:?}");
            }
        }
    }

    /// Its modules, which seemed to rest, have shown no pace by then.
    #[test]
    fn of_two_orders_to_walk_that_meet_one_to_stop_the_pace_tells_later_which_counts() {
        let chain = Shape::Chain.wiring(6).unwrap();
        let long = Period::of_milliseconds(4000).unwrap();
        let [own, longer] = [Period::OWN, long].map(|period| beat(&period.of(Serpentine.gait())));
        for beat in [own, longer] {
            let mut orders = Orders::new(6);
            orders.give(&chain, 0, (Serpentine as u8, Period::OWN), AT);
            orders.give(&chain, 2, (Serpentine as u8, long), AT + 1);
            orders.give(&chain, 5, (STOP, Period::OWN), AT + 2);
            let says = |_| Some(walking(Serpentine));
            let walks_at = AT + 2 + DISCOVERY + 2 * longer;
            orders.choose(&chain, walks_at, says, |_| None);
            assert!(orders.gait(3).is_some());
            orders.choose(&chain, walks_at + DISCOVERY + 2 * longer, says, |_| Some(beat));
            let counts = orders.gait(3).map(|gait| super::beat(&gait));
            assert_eq!(counts, Some(beat));
        }
    }

    /// The front part has taken up one of two orders that met, and joins one that was ordered once.
    #[test]
    fn a_body_in_doubt_that_joins_another_may_bring_either_order() {
        let whole = Shape::Chain.wiring(6).unwrap();
        let mut cut = whole.clone();
        cut.detach(Face { module: 2, dock: Back }).unwrap();
        for said in [SixLegs, Serpentine] {
            let mut orders = Orders::new(6);
            orders.give(&cut, 4, (Serpentine as u8, Period::OWN), 0);
            orders.give(&cut, 0, (Caterpillar as u8, Period::OWN), AT);
            orders.give(&cut, 2, (SixLegs as u8, Period::OWN), AT + 1);
            orders.rewired(&cut, &whole, AT + 2);
            orders.choose(&whole, AT + 2 + DISCOVERY, |_| Some(walking(said)), |_| None);
            assert_eq!([0, 5].map(|module| orders.gait(module).unwrap().name), [said as u8; 2]);
        }
    }

    #[test]
    fn between_an_order_to_stop_and_one_to_walk_it_counts_whether_any_module_acts() {
        let chain = Shape::Chain.wiring(6).unwrap();
        for (first, second) in [(STOP, Serpentine as u8), (Serpentine as u8, STOP)] {
            for is_acting in [true, false] {
                let mut orders = Orders::new(6);
                orders.give(&chain, 0, (first, Period::OWN), AT);
                orders.give(&chain, 5, (second, Period::OWN), AT + 1);
                let status = |module| {
                    Some(if is_acting && module == 2 { walking(Serpentine) } else { Status::POWER_UP })
                };
                orders.choose(&chain, AT + 3 * DISCOVERY, status, |_| None);
                assert_eq!(orders.gait(3).is_some(), is_acting, "{first} {second}");
            }
        }
    }

    /// Its modules have to find out first who leads them now.
    #[test]
    fn what_a_body_does_tells_later_where_it_has_been_cut() {
        let whole = Shape::Chain.wiring(6).unwrap();
        let mut cut = whole.clone();
        cut.detach(Face { module: 2, dock: Back }).unwrap();
        let beat = beat(&Serpentine.gait());
        let due = AT + DISCOVERY + beat;
        for is_cut in [true, false] {
            let mut orders = Orders::new(6);
            orders.give(&whole, 0, (STOP, Period::OWN), AT);
            orders.give(&whole, 5, (Serpentine as u8, Period::OWN), AT);
            let wiring = if is_cut { &cut } else { &whole };
            orders.rewired(&whole, wiring, due - 1);
            orders.choose(wiring, due, |_| Some(Status::POWER_UP), |_| None);
            assert_eq!(orders.gait(3).is_some(), is_cut);
            orders.choose(wiring, due + DISCOVERY + beat, |_| Some(Status::POWER_UP), |_| None);
            assert!(orders.gait(3).is_none());
        }
    }

    #[test]
    fn where_frames_are_lost_what_a_body_does_tells_later() {
        let chain = Shape::Chain.wiring(6).unwrap();
        let mut orders = Orders::new(6);
        orders.loses(4.0);
        orders.give(&chain, 0, (Caterpillar as u8, Period::OWN), AT);
        orders.give(&chain, 5, (Serpentine as u8, Period::OWN), AT);
        let says = |_| Some(walking(Caterpillar));
        assert!(orders.choose(&chain, AT + 4 * DISCOVERY - 1, says, |_| None).is_empty());
        assert!(!orders.choose(&chain, AT + 4 * DISCOVERY, says, |_| None).is_empty());
    }

    /// A chain is what an opened ring becomes, so it soon has to walk on, unless it has stopped.
    #[test]
    fn between_an_order_to_stop_and_the_gait_that_follows_another_order_it_counts_whether_any_module_acts() {
        let chain = Shape::Chain.wiring(6).unwrap();
        // A module that has stopped names the gait of before.
        let resting = Status { gait: Caterpillar as u8, ..Status::POWER_UP };
        for says in [Some(walking(Caterpillar)), Some(resting), Some(Status::POWER_UP), None] {
            let mut orders = Orders::new(6);
            orders.give(&chain, 0, (STOP, Period::OWN), AT);
            orders.give(&chain, 5, (OpenRing as u8, Period::OWN), AT + 1);
            orders.choose(&chain, AT + LASTS, |_| says, |_| None);
            orders.settle(&chain, AT + 1 + LASTS);
            orders.choose(&chain, AT + 2 * LASTS + 3 * DISCOVERY, |_| says, |_| None);
            let counts = says.filter(|says| says.action != Action::Rest).map(|says| says.gait);
            assert_eq!(orders.gait(3).map(|gait| gait.name), counts, "{says:?}");
        }
    }

    /// Until then it rests, whichever of both orders it follows.
    #[test]
    fn between_an_order_to_stop_and_one_to_roll_it_counts_whether_a_ring_acts_that_has_elected_a_leader() {
        let ring = Shape::Ring.wiring(6).unwrap();
        for action in [Action::Curl, Action::Rest] {
            let mut orders = Orders::new(6);
            orders.give(&ring, 0, (STOP, Period::OWN), AT);
            orders.give(&ring, 3, (RollingTrack as u8, Period::OWN), AT + 1);
            let due = AT + 1 + DISCOVERY + election(Leader::Elected);
            assert!(orders.choose(&ring, due - 1, |_| Some(Status::POWER_UP), |_| None).is_empty());
            let says = Status { action, ..walking(RollingTrack) };
            orders.choose(&ring, due + 4 * DISCOVERY, |_| Some(says), |_| None);
            let counts = (action != Action::Rest).then_some(RollingTrack as u8);
            assert_eq!(orders.gait(2).map(|gait| gait.name), counts);
        }
    }

    #[test]
    fn an_order_of_what_was_ordered_already_may_come_after_another_order() {
        let chain = Shape::Chain.wiring(6).unwrap();
        for (after, said, counts) in [
            (COMING, Caterpillar, Caterpillar),
            (COMING, Serpentine, Serpentine),
            (COMING + 1, Caterpillar, Serpentine),
        ] {
            let mut orders = Orders::new(6);
            for (gait, at) in [(Caterpillar, 0), (Caterpillar, AT), (Serpentine, AT + after)] {
                orders.give(&chain, 2, (gait as u8, Period::OWN), at);
            }
            orders.choose(&chain, AT + after + 2 * DISCOVERY, |_| Some(walking(said)), |_| None);
            let named = orders.gait(4).map(|gait| gait.name);
            assert_eq!(named, Some(counts as u8), "{after} {said:?}");
        }
    }

    /// Module 3 does not know yet that module 0 was ordered, and counts its own order as the first.
    #[test]
    fn a_module_may_be_ordered_before_it_knows_the_order_of_the_body_that_it_has_joined() {
        let whole = Shape::Chain.wiring(6).unwrap();
        let mut cut = whole.clone();
        cut.detach(Face { module: 2, dock: Back }).unwrap();
        for (after, is_open) in [(DISCOVERY - 1, true), (DISCOVERY, false)] {
            let mut orders = Orders::new(6);
            orders.give(&cut, 0, (Serpentine as u8, Period::OWN), 0);
            orders.rewired(&cut, &whole, AT);
            orders.give(&whole, 3, (Caterpillar as u8, Period::OWN), AT + after);
            orders.choose(&whole, AT + 3 * DISCOVERY, |_| Some(walking(Serpentine)), |_| None);
            let counts = if is_open { Serpentine } else { Caterpillar };
            assert_eq!([0, 3].map(|module| orders.gait(module).unwrap().name), [counts as u8; 2], "{after}");
        }
    }
}
