//! By which gait each body of a robot has to walk: the one that it was ordered last, whoever of it heard the
//! order, and however far that may go. Bodies that join walk by the newer order.

use hormone::gait::{Gait, GaitName, Once};

use crate::reach::{acting, leads};
use crate::wiring::Wiring;

/// An order, or the gait that a module begins with.
#[derive(Clone, Copy, PartialEq)]
struct Order {
    /// Orders are numbered as they are given.
    number: u64,
    gait: GaitName,
}

/// The orders that modules have to follow.
pub struct Orders {
    /// By module.
    of: Vec<Order>,
    given: u64,
}

impl Orders {
    /// So many modules at power-up: they begin with the centipede's gait.
    pub fn new(modules: usize) -> Self {
        Orders { of: vec![Order { number: 0, gait: GaitName::Centipede }; modules], given: 0 }
    }

    /// The gait that a module has to walk by.
    pub fn gait(&self, module: usize) -> Gait {
        self.of[module].gait.gait()
    }

    /// The body of a module is ordered to walk by this gait. Returns whom that is new to.
    pub fn give(&mut self, wiring: &Wiring, module: usize, gait: GaitName) -> Vec<usize> {
        self.given += 1;
        let is_other = self.of[module].gait != gait;
        self.of[module] = Order { number: self.given, gait };
        let mut changed = self.spread(wiring);
        changed.extend(is_other.then_some(module));
        changed
    }

    /// The wiring was one and is another now. A change of shape that has come to its end, for nobody of the
    /// body leads it any more, is followed by the next gait. Bodies that joined go on by the newer order.
    /// Returns who walks by another gait than before.
    pub fn rewired(&mut self, before: &Wiring, wiring: &Wiring) -> Vec<usize> {
        let mut changed = Vec::new();
        for body in wiring.bodies() {
            let ended = |&&module: &&usize| {
                let Gait { leader, once, .. } = self.gait(module);
                once.is_some_and(|Once { becomes, .. }| acting(wiring, module) == becomes)
                    && leads(before, module, leader).is_some()
                    && !body.iter().any(|&other| leads(wiring, other, leader).is_some())
            };
            if let Some(&module) = body.iter().find(ended)
                && let Some(once) = self.gait(module).once
            {
                changed.append(&mut self.give(wiring, module, once.then));
            }
        }
        changed.append(&mut self.spread(wiring));
        changed
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
                changed.extend((before.gait != newest.gait).then_some(module));
            }
        }
        changed
    }
}
