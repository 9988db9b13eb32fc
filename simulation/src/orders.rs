//! By which gait each body of a robot has to walk: the one that it was ordered last, whoever of it heard the
//! order. Bodies that join walk by the newer order, and who has taken another shape by the gait that follows.

use hormone::gait::{Gait, GaitName, Once};

use crate::hardware::MILLISECOND;
use crate::leader::{acting, leads};
use crate::wiring::Wiring;

/// For how long a robot has to have another shape until it has taken it.
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
    pub fn give(&mut self, wiring: &Wiring, module: usize, gait: Option<Gait>) -> Vec<usize> {
        self.given += 1;
        let order = Order { number: self.given, gait };
        let before = std::mem::replace(&mut self.of[module], order);
        let mut changed = self.spread(wiring);
        changed.extend((!before.is_like(order)).then_some(module));
        changed
    }

    /// The wiring was one and is another now: bodies that joined go on by the newer order. Returns who walks
    /// by another gait than before.
    pub fn rewired(&mut self, before: &Wiring, wiring: &Wiring, now: u64) -> Vec<usize> {
        let waiting = std::mem::take(&mut self.reshaped);
        for body in wiring.bodies() {
            let ended = |module: usize| {
                let Gait { leader, once: Some(Once { becomes, then }), .. } = self.gait(module)? else {
                    return None;
                };
                let begun = waiting.iter().find(|reshaped| reshaped.module == module).map(|it| it.at);
                let has_ended = (begun.is_some() || leads(before, module, leader).is_some())
                    && acting(wiring, module) == becomes
                    && !body.iter().any(|&other| leads(wiring, other, leader).is_some());
                has_ended.then(|| Reshaped { module, then, at: begun.unwrap_or(now + LASTS) })
            };
            self.reshaped.extend(body.iter().find_map(|&module| ended(module)));
        }
        self.spread(wiring)
    }

    /// When a robot will have taken another shape, if nothing happens before.
    pub fn next(&self) -> Option<u64> {
        self.reshaped.iter().map(|reshaped| reshaped.at).min()
    }

    /// Has the bodies that have taken another shape by `now` walk by the gait that follows, if they have not
    /// been ordered otherwise meanwhile. Returns whom that is new to.
    pub fn settle(&mut self, wiring: &Wiring, now: u64) -> Vec<usize> {
        let mut over: Vec<Reshaped> = self.reshaped.extract_if(.., |reshaped| reshaped.at <= now).collect();
        over.retain(|reshaped| {
            let once = self.gait(reshaped.module).and_then(|gait| gait.once);
            once.is_some_and(|once| once.then == reshaped.then)
        });
        let give = |Reshaped { module, then, .. }| self.give(wiring, module, Some(GaitName::gait(then)));
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
