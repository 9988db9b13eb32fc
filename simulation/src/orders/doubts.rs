//! Bodies of which nobody outside knows which of two orders they follow. A link may fail while an order is on
//! its way. Two modules may be ordered at once. A module may be ordered before it knows the order of the body
//! that it has joined.

use std::sync::Arc;

use super::Order;
use crate::command::SENDS;
use crate::hardware::{GIVEN_UP_AFTER, MILLISECOND};
use crate::walker::{DISCOVERY, HOP};
use crate::wiring::Wiring;

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

/// The body of a module follows an order, or none of it does. The gait by which the module says that it walks
/// decides; between walking and an order to stop, whether any module acts.
pub struct Doubt {
    pub module: usize,
    /// The number of the order.
    pub order: u64,
    /// By module, what counts instead.
    pub instead: Arc<[Order]>,
    at: u64,
}

/// Finds out where there is a doubt.
#[derive(Default)]
pub struct Doubts {
    spreading: Vec<Spreading>,
    before: Vec<Before>,
    open: Vec<Doubt>,
}

/// What was before a change. Modules may not notice that until this time, and may hear each other as before:
/// a link may fail in one direction.
struct Before {
    wiring: Wiring,
    /// By module.
    orders: Arc<[Order]>,
    until: u64,
}

impl Doubts {
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
        // A remote control repeats an order, of which a dock may hear only the last sending.
        let heard_by = |it: &Spreading| it.given_at + SENDS[SENDS.len() - 1] + GIVEN_UP_AFTER;
        let is_other =
            |it: &Spreading| it.order == of[module].number && (it.module != module || now <= heard_by(it));
        if self.spreading.iter().any(is_other) {
            self.open(module, order, of.into(), now);
        }
        let mut is_apart = vec![false; of.len()];
        for before in &self.before {
            hearing(&before.wiring, module).into_iter().for_each(|it| is_apart[it] = true);
        }
        hearing(wiring, module).into_iter().for_each(|it| is_apart[it] = false);
        let instead: Arc<[Order]> = vec![order; of.len()].into();
        for body in wiring.bodies() {
            if let Some(other) = body.into_iter().find(|&it| is_apart[it]) {
                self.open(other, of[other], Arc::clone(&instead), now);
            }
        }
        let until = now + DISCOVERY + of.len() as u64 * HOP;
        let (order, before) = (order.number, of.into());
        self.spreading.push(Spreading { module, order, before, given_at: now, until });
        (0..of.len()).filter(|&it| is_apart[it]).collect()
    }

    /// Takes in a changed wiring, before modules with the orders `of` hear each other by it: those that are
    /// cut off from an order may not have heard of it.
    pub fn rewired(&mut self, of: &[Order], (before, wiring): (&Wiring, &Wiring), now: u64) {
        self.forget(now);
        self.before.push(Before { wiring: before.clone(), orders: of.into(), until: now + DISCOVERY });
        let mut cut_off = Vec::new();
        for Spreading { module, order, before, .. } in &self.spreading {
            for body in wiring.bodies().into_iter().filter(|body| !body.contains(module)) {
                let with_order = body.into_iter().find(|&other| of[other].number == *order);
                cut_off.extend(with_order.map(|other| (other, Arc::clone(before))));
            }
        }
        for (module, before) in cut_off {
            self.open(module, of[module], before, now);
        }
    }

    /// The orders that a module may still follow, where it has joined a body with another.
    pub fn known(&self, module: usize) -> Vec<Order> {
        self.before.iter().map(|before| before.orders[module]).collect()
    }

    /// The doubts that are to be settled by `now`.
    pub fn due(&mut self, now: u64) -> Vec<Doubt> {
        self.open.extract_if(.., |doubt| doubt.at <= now).collect()
    }

    /// Between two orders there is a doubt if what modules do can tell them apart. Whether they act shows at
    /// the first beat.
    pub fn open(&mut self, module: usize, order: Order, instead: Arc<[Order]>, now: u64) {
        let beat = match (order.gait(), instead[module].gait()) {
            (Some(gait), Some(other)) if gait.name != other.name => 0,
            (Some(gait), None) | (None, Some(gait)) => u64::from(gait.beat.get()) * MILLISECOND,
            _ => return,
        };
        self.open.push(Doubt { module, order: order.number, instead, at: now + DISCOVERY + beat });
    }

    fn forget(&mut self, now: u64) {
        self.spreading.retain(|spreading| now < spreading.until);
        self.before.retain(|before| now < before.until);
    }
}

/// The modules that hear this one, directly or by way of others.
pub fn hearing(wiring: &Wiring, module: usize) -> Vec<usize> {
    wiring.bodies().into_iter().find(|body| body.contains(&module)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use hormone::gait::GaitName::{self, Caterpillar, Centipede, Serpentine};
    use hormone::period::Period;
    use hormone::status::Status;
    use tasks::dock::Dock::Back;

    use super::super::Orders;
    use super::super::tests::walking;
    use super::*;
    use crate::shape::Shape;
    use crate::wiring::Face;

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
                orders.give(wiring, module, (Some(gait), Period::OWN), at);
            } else {
                orders.rewired(wiring, &cut, at);
                wiring = &cut;
            }
        }
        assert!(orders.choose(wiring, AT + DISCOVERY - 1, |_| Some(walking(said))).is_empty(), "too soon");
        orders.choose(wiring, AT + 2 * DISCOVERY, |_| Some(walking(said)));
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
    fn between_an_order_to_stop_and_one_to_walk_it_counts_whether_any_module_acts() {
        let chain = Shape::Chain.wiring(6).unwrap();
        for (first, second) in [(None, Some(Serpentine)), (Some(Serpentine), None)] {
            for is_acting in [true, false] {
                let mut orders = Orders::new(6);
                orders.give(&chain, 0, (first, Period::OWN), AT);
                orders.give(&chain, 5, (second, Period::OWN), AT + 1);
                orders.choose(&chain, AT + 3 * DISCOVERY, |module| {
                    Some(if is_acting && module == 2 { walking(Serpentine) } else { Status::POWER_UP })
                });
                assert_eq!(orders.gait(3).is_some(), is_acting, "{first:?} {second:?}");
            }
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
            orders.give(&cut, 0, (Some(Serpentine), Period::OWN), 0);
            orders.rewired(&cut, &whole, AT);
            orders.give(&whole, 3, (Some(Caterpillar), Period::OWN), AT + after);
            orders.choose(&whole, AT + 3 * DISCOVERY, |_| Some(walking(Serpentine)));
            let counts = if is_open { Serpentine } else { Caterpillar };
            assert_eq!([0, 3].map(|module| orders.gait(module).unwrap().name), [counts as u8; 2], "{after}");
        }
    }
}
