//! Which modules hormones reach by the rules of the gaits, and which a change concerns.

use std::collections::VecDeque;

use hormone::module_type::ModuleType;
use tasks::dock::{Dock, DockSet};

use crate::leader::{acting, leads};
use crate::orders::Orders;
use crate::wiring::{Face, Wiring};

/// How many hops hormones take to each module from the nearest one that leads; `None` where none can come.
/// Chance decides which module leads a ring, so each counts as the last one behind the leader.
pub fn hops(wiring: &Wiring, orders: &Orders) -> Vec<Option<u64>> {
    let mut hops = vec![None; wiring.modules()];
    let mut next: VecDeque<(usize, u64)> = VecDeque::new();
    for module in 0..wiring.modules() {
        let size = orders.gait(module).and_then(|gait| leads(wiring, module, gait.leader));
        next.extend(size.map(|size| (module, size - 1)));
    }
    while let Some((module, distance)) = next.pop_front() {
        if hops[module].is_none() {
            hops[module] = Some(distance);
            next.extend(behind(wiring, orders, module).map(|peer| (peer, distance + 1)));
        }
    }
    hops
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

/// The modules to which a module sends hormones on: by the docks that its rules name or, if it has no type,
/// by all.
fn behind<'a>(wiring: &'a Wiring, orders: &Orders, module: usize) -> impl Iterator<Item = usize> + 'a {
    let ways = match (acting(wiring, module), orders.gait(module)) {
        (_, None) => DockSet::EMPTY,
        (ModuleType::Other, _) => DockSet::of(&Dock::ALL),
        (module_type, Some(gait)) => gait.ways(module_type),
    };
    let faces = Dock::ALL.into_iter().filter(move |&dock| ways.contains(dock));
    faces.filter_map(move |dock| Some(wiring.peer(Face { module, dock })?.module))
}
