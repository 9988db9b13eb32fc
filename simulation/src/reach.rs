//! Which modules hormones reach by the rules of the gaits, and which a change concerns.

use std::collections::VecDeque;

use hormone::module_type::ModuleType;
use tasks::dock::{Dock, DockSet};

use crate::leader::{acting, leads};
use crate::orders::Orders;
use crate::wiring::{Face, Wiring};

/// The way of hormones to a module, from the nearest one that leads.
#[derive(Clone, Copy)]
pub struct Way {
    pub hops: u64,
    /// How many of the modules on it, the last one among them, have a choice.
    pub choices: u64,
}

/// The way of hormones to each module; `None` where none can come. Chance decides which module leads a ring,
/// so each counts as the last one behind the leader. These modules have a choice.
pub fn shortest_ways(wiring: &Wiring, orders: &Orders, has_choice: &[bool]) -> Vec<Option<Way>> {
    let mut ways = vec![None; wiring.modules()];
    let mut next: VecDeque<(usize, Way)> = VecDeque::new();
    for module in 0..wiring.modules() {
        let size = led_by(wiring, orders, module);
        next.extend(size.map(|size| (module, Way { hops: size - 1, choices: 0 })));
    }
    while let Some((module, Way { hops, mut choices })) = next.pop_front() {
        if ways[module].is_none() {
            choices += u64::from(has_choice[module]);
            ways[module] = Some(Way { hops, choices });
            let onward = Way { hops: hops + 1, choices };
            next.extend(behind(wiring, orders, module).map(|peer| (peer, onward)));
        }
    }
    ways
}

/// Among how many modules this one may be the leader by its order, as [`leads`] has it.
pub fn led_by(wiring: &Wiring, orders: &Orders, module: usize) -> Option<u64> {
    orders.gait(module).and_then(|gait| leads(wiring, module, gait.leader))
}

/// By module, whether it is one of `touched`, or gets hormones by way of one of them.
pub fn concerned(wiring: &Wiring, orders: &Orders, touched: &[usize]) -> Vec<bool> {
    let mut concerned = vec![false; wiring.modules()];
    let mut next = touched.to_vec();
    while let Some(module) = next.pop() {
        if !std::mem::replace(&mut concerned[module], true) {
            next.extend(behind(wiring, orders, module));
        }
    }
    concerned
}

/// By module, the docks by which hormones come to it by the rules.
pub fn ways(wiring: &Wiring, orders: &Orders) -> Vec<DockSet> {
    let is_leader = |module: usize| led_by(wiring, orders, module).is_some();
    let leaders: Vec<bool> = (0..wiring.modules()).map(is_leader).collect();
    let mut ways = vec![DockSet::EMPTY; wiring.modules()];
    let of_leader = |module: usize| leaders[module].then_some((module, None));
    let mut next: Vec<(usize, Option<Dock>)> = (0..wiring.modules()).filter_map(of_leader).collect();
    while let Some((module, source)) = next.pop() {
        for (dock, peer) in faces_behind(wiring, orders, module) {
            // No hormone goes back to where it came from, and a leader follows none.
            let is_followed = Some(dock) != source && !leaders[peer.module];
            if is_followed && !ways[peer.module].contains(peer.dock) {
                ways[peer.module].insert(peer.dock);
                next.push((peer.module, Some(peer.dock)));
            }
        }
    }
    ways
}

/// The modules to which a module sends hormones on.
fn behind<'a>(wiring: &'a Wiring, orders: &Orders, module: usize) -> impl Iterator<Item = usize> + 'a {
    faces_behind(wiring, orders, module).map(|(_, peer)| peer.module)
}

/// The docks by which a module sends hormones on, those that its rules name or, if it has no type, all; and
/// where hormones come in there.
fn faces_behind<'a>(
    wiring: &'a Wiring,
    orders: &Orders,
    module: usize,
) -> impl Iterator<Item = (Dock, Face)> + 'a {
    let ways = match (acting(wiring, module), orders.gait(module)) {
        (_, None) => DockSet::EMPTY,
        (ModuleType::Other, _) => DockSet::of(&Dock::ALL),
        (module_type, Some(gait)) => gait.ways(module_type),
    };
    let docks = Dock::ALL.into_iter().filter(move |&dock| ways.contains(dock));
    docks.filter_map(move |dock| Some((dock, wiring.peer(Face { module, dock })?)))
}

#[cfg(test)]
mod tests {
    use hormone::gait::GaitName::{Caterpillar, RollingTrack};
    use hormone::period::Period;

    use super::*;
    use crate::shape::Shape;

    #[test]
    fn hormones_come_by_the_front_to_modules_that_follow_and_by_no_dock_to_those_that_may_lead() {
        let [none, follows] = [DockSet::EMPTY, DockSet::of(&[Dock::Front])];
        for (shape, gait, expected) in [
            (Shape::Chain, Caterpillar, [none, follows, follows, follows]),
            (Shape::Ring, RollingTrack, [none; 4]),
        ] {
            let wiring = shape.wiring(4).unwrap();
            let mut orders = Orders::new(4);
            orders.give(&wiring, 0, (gait as u8, Period::OWN), 0);
            assert!(ways(&wiring, &orders) == expected, "{shape:?}");
        }
    }
}
