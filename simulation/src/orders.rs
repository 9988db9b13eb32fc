//! By which gait each body of a robot has to walk: the one that it was ordered last, whoever of it heard the
//! order. Bodies that join walk by the newer order, and who has taken another shape by the gait that follows.

use hormone::gait::{Gait, GaitName, Once};

use crate::hardware::MILLISECOND;
use crate::leader::{acting, leads};
use crate::wiring::Wiring;

/// For how long a robot has to have the shape that its gait makes of it until it has taken it.
const LASTS: u64 = 1_000 * MILLISECOND;

/// An order, or the gait that a module begins with.
#[derive(Clone, Copy)]
struct Order {
    /// Orders are numbered as they are given.
    number: u64,
    /// `None`: to stop.
    gait: Option<Gait>,
}

/// A change of shape that has come to its end, if it lasts.
struct Reshaped {
    module: usize,
    /// The number of the order that it ends.
    order: u64,
    then: GaitName,
    at: u64,
}

/// The orders that modules have to follow.
pub struct Orders {
    /// By module.
    of: Vec<Order>,
    given: u64,
    reshaped: Vec<Reshaped>,
}

impl Orders {
    /// So many modules at power-up: they begin with the centipede's gait.
    pub fn new(modules: usize) -> Self {
        let first = Order { number: 0, gait: Some(GaitName::Centipede.gait()) };
        Orders { of: vec![first; modules], given: 0, reshaped: Vec::new() }
    }

    /// The gait that a module has to walk by; `None` if it was ordered to stop.
    pub fn gait(&self, module: usize) -> Option<Gait> {
        self.of[module].gait
    }

    /// The body of a module is ordered to walk by this gait, or to stop. Returns whom that is new to.
    pub fn give(&mut self, wiring: &Wiring, module: usize, gait: Option<Gait>, now: u64) -> Vec<usize> {
        self.given += 1;
        let order = Order { number: self.given, gait };
        let before = std::mem::replace(&mut self.of[module], order);
        let mut changed = self.spread(wiring);
        changed.extend((!before.is_like(order)).then_some(module));
        // It may have the shape already that the gait makes of it.
        self.look(wiring, now);
        changed
    }

    /// The wiring is another than before: bodies that joined go on by the newer order. Returns who walks by
    /// another gait than before.
    pub fn rewired(&mut self, wiring: &Wiring, now: u64) -> Vec<usize> {
        let changed = self.spread(wiring);
        self.look(wiring, now);
        changed
    }

    /// Looks which bodies have the shape that their gait makes of them: one in which the next gait has a leader.
    fn look(&mut self, wiring: &Wiring, now: u64) {
        let waiting = std::mem::take(&mut self.reshaped);
        for body in wiring.bodies() {
            let ended = |module: usize| {
                let Once { becomes, then } = self.gait(module)?.once?;
                if acting(wiring, module) != becomes {
                    return None;
                }
                leads(wiring, module, GaitName::gait(then).leader)?;
                let order = self.of[module].number;
                let is_same = |it: &&Reshaped| it.order == order && body.contains(&it.module);
                let at = waiting.iter().find(is_same).map_or(now + LASTS, |it| it.at);
                Some(Reshaped { module, order, then, at })
            };
            self.reshaped.extend(body.iter().find_map(|&module| ended(module)));
        }
    }

    /// When a robot will have taken another shape, if nothing happens before.
    pub fn next(&self) -> Option<u64> {
        self.reshaped.iter().map(|reshaped| reshaped.at).min()
    }

    /// Has the bodies that have taken another shape by `now` walk by the gait that follows, if they have not
    /// been ordered otherwise meanwhile. Returns whom that is new to.
    pub fn settle(&mut self, wiring: &Wiring, now: u64) -> Vec<usize> {
        let mut over: Vec<Reshaped> = self.reshaped.extract_if(.., |reshaped| reshaped.at <= now).collect();
        over.retain(|reshaped| self.of[reshaped.module].number == reshaped.order);
        let give = |Reshaped { module, then, .. }| self.give(wiring, module, Some(GaitName::gait(then)), now);
        over.into_iter().flat_map(give).collect()
    }

    /// Has all modules of a body follow the newest order that any of them has. Returns who walks by another
    /// gait now.
    fn spread(&mut self, wiring: &Wiring) -> Vec<usize> {
        let mut changed = Vec::new();
        for body in wiring.bodies() {
            let newest = body.iter().map(|&module| self.of[module]).max_by_key(|order| order.number);
            let Some(newest) = newest else { continue };
            for module in body {
                let before = std::mem::replace(&mut self.of[module], newest);
                changed.extend((!before.is_like(newest)).then_some(module));
            }
        }
        changed
    }
}

impl Order {
    /// Whether both ask for the same.
    fn is_like(self, other: Order) -> bool {
        let what = |order: Order| order.gait.map(|gait| (gait.name, gait.beat));
        what(self) == what(other)
    }
}

#[cfg(test)]
mod tests {
    use hormone::gait::GaitName::{Caterpillar, CloseRing, OpenRing, RollingTrack};
    use tasks::dock::Dock::Back;

    use super::*;
    use crate::shape::Shape;
    use crate::wiring::Face;

    fn ordered(wiring: &Wiring, gait: GaitName) -> Orders {
        let mut orders = Orders::new(wiring.modules());
        orders.give(wiring, 0, Some(gait.gait()), 0);
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
    fn all_parts_of_a_ring_that_opens_have_to_walk_on() {
        let mut wiring = Shape::Ring.wiring(6).unwrap();
        let mut orders = ordered(&wiring, OpenRing);
        for (module, at) in [(0, 0), (3, 10)] {
            wiring.detach(Face { module, dock: Back }).unwrap();
            orders.rewired(&wiring, at);
        }
        let name =
            |orders: &Orders, module| orders.gait(module).and_then(|gait| GaitName::from_byte(gait.name));
        for (at, gaits) in [(LASTS, [Caterpillar, OpenRing]), (LASTS + 10, [Caterpillar, Caterpillar])] {
            orders.settle(&wiring, at);
            assert_eq!([1, 4].map(|module| name(&orders, module)), gaits.map(Some), "{at}");
        }
    }
}
