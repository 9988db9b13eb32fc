//! Which module leads, and by which rules a module acts, by the wiring alone.

use hormone::gait::Leader;
use hormone::module_type::ModuleType;
use tasks::dock::Dock;

use crate::wiring::{Face, Wiring};

/// Among how many modules this one may be the leader, by the wiring: in a ring it is one of so many, else the
/// only one. `None` if it can't lead.
pub fn leads(wiring: &Wiring, module: usize, leader: Leader) -> Option<u64> {
    match leader {
        Leader::Head => (acting(wiring, module) == ModuleType::Head).then_some(1),
        // A module without power has no neighbour either.
        Leader::Alone => {
            (wiring.has_power(module) && acting(wiring, module) == ModuleType::Alone).then_some(1)
        }
        Leader::Elected => ring(wiring, module),
    }
}

/// The number of modules of a ring of spines, for one of them.
fn ring(wiring: &Wiring, module: usize) -> Option<u64> {
    let mut next = module;
    for size in 1..=wiring.modules() {
        if acting(wiring, next) != ModuleType::Spine {
            return None;
        }
        next = wiring.peer(Face { module: next, dock: Dock::Back })?.module;
        if next == module {
            return Some(size as u64);
        }
    }
    None
}

/// The type whose rules a module follows, by the wiring.
pub fn acting(wiring: &Wiring, module: usize) -> ModuleType {
    ModuleType::acting(&wiring.neighbours(module))
}
