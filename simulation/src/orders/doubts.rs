//! Bodies of which nobody outside knows which of two orders they follow, for a link may fail while an order
//! is on its way, and two modules may be ordered at once.

use std::sync::Arc;

use super::Order;
use crate::walker::{DISCOVERY, HOP};
use crate::wiring::Wiring;

/// An order on its way from the module to which it was given.
struct Spreading {
    module: usize,
    /// Its number.
    order: u64,
    /// By module, the order before.
    before: Arc<[Order]>,
    until: u64,
}

/// The body of a module follows an order, or none of it does. The gait by which the module says that it walks
/// decides.
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
    /// The wirings from before, whose modules may hear each other until these times: a link may fail in one
    /// direction.
    before: Vec<(Wiring, u64)>,
    open: Vec<Doubt>,
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
        let is_other = |it: &Spreading| it.order == of[module].number && it.module != module;
        if self.spreading.iter().any(is_other) {
            self.open(module, order, of.into(), now);
        }
        let mut is_apart = vec![false; of.len()];
        for (before, _) in &self.before {
            hearing(before, module).into_iter().for_each(|it| is_apart[it] = true);
        }
        hearing(wiring, module).into_iter().for_each(|it| is_apart[it] = false);
        let instead: Arc<[Order]> = vec![order; of.len()].into();
        for body in wiring.bodies() {
            if let Some(other) = body.into_iter().find(|&it| is_apart[it]) {
                self.open(other, of[other], Arc::clone(&instead), now);
            }
        }
        let until = now + DISCOVERY + of.len() as u64 * HOP;
        self.spreading.push(Spreading { module, order: order.number, before: of.into(), until });
        (0..of.len()).filter(|&it| is_apart[it]).collect()
    }

    /// Takes in a changed wiring, before modules with the orders `of` hear each other by it: those that are
    /// cut off from an order may not have heard of it.
    pub fn rewired(&mut self, of: &[Order], (before, wiring): (&Wiring, &Wiring), now: u64) {
        self.forget(now);
        self.before.push((before.clone(), now + DISCOVERY));
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

    /// The doubts that are to be settled by `now`.
    pub fn due(&mut self, now: u64) -> Vec<Doubt> {
        self.open.extract_if(.., |doubt| doubt.at <= now).collect()
    }

    /// Between two orders there is a doubt if a module's gait can tell them apart. It tells nothing of an
    /// order to stop.
    fn open(&mut self, module: usize, order: Order, instead: Arc<[Order]>, now: u64) {
        if let (Some(gait), Some(other)) = (order.gait(), instead[module].gait())
            && gait.name != other.name
        {
            self.open.push(Doubt { module, order: order.number, instead, at: now + DISCOVERY });
        }
    }

    fn forget(&mut self, now: u64) {
        self.spreading.retain(|spreading| now < spreading.until);
        self.before.retain(|&(_, until)| now < until);
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
    use tasks::dock::Dock::Back;

    use super::super::Orders;
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
        assert!(orders.choose(wiring, AT + DISCOVERY - 1, |_| Some(said as u8)).is_empty(), "too soon");
        orders.choose(wiring, AT + 2 * DISCOVERY, |_| Some(said as u8));
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
}
