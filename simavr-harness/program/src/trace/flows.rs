//! Draws arrows for what passes between MCUs: frames from dock to dock, and hormones from HORMONE to HORMONE.

use std::collections::HashMap;

use simavr_harness::{Controller, Face, Wiring};
use simulation::{Recording, lateness};
use tasks::dock::Dock;
use tasks::superbot::{Half, MASTER, SLAVE};

use super::super::mcu_name::McuName;
use super::Traced;
use super::events::{Events, Track};
use super::frames::{Piece, describe};
use super::schedule;

/// The task that acts on hormones, on the master.
const HORMONE: &str = "HORMONE";

/// The dock at which a serial port of an MCU is.
pub fn dock(controller: Controller, port: usize) -> Option<Dock> {
    half(controller).docks().get(port).copied()
}

/// The pieces that passed at a dock, and the tracks that show them.
pub struct Passed {
    pub sent: Vec<Piece>,
    pub received: Vec<Piece>,
    pub out: Track,
    pub into: Track,
}

/// Draws an arrow for each frame that left one traced MCU and came to another. `end` is the end of the run.
pub fn frames(events: &mut Events, passed: &HashMap<Face, Passed>, recording: &Recording, end: u64) {
    let mut faces: Vec<Face> = passed.keys().copied().collect();
    faces.sort_by_key(|face| (face.module, face.dock.index()));
    for from in faces {
        let here = &passed[&from];
        for piece in &here.sent {
            let Some(wiring) = wiring_at(recording, piece.begin) else { continue };
            let Some(to) = wiring.peer(from) else { continue };
            let Some(there) = passed.get(&to) else { continue };
            let begin = piece.begin + lateness(from.dock, to.dock, wiring.shares_light());
            let arrives = there.received.binary_search_by_key(&begin, |piece| piece.begin);
            if arrives.is_ok() && begin < end {
                events.flow(&describe(&piece.what).0, (here.out, piece.begin), (there.into, begin));
            }
        }
    }
}

/// Draws an arrow for each hormone that a traced master sent and another one took up.
pub fn hormones(events: &mut Events, traced: &[Traced], recording: &Recording) {
    let track = |module: usize| {
        let name = McuName { module, controller: Controller::Master };
        let number = traced.iter().position(|traced| traced.name == name)?;
        schedule::track(number, &traced[number].trace, HORMONE)
    };
    for passage in &recording.hormones {
        let Some(arrived) = passage.arrived else { continue };
        let peer = wiring_at(recording, passage.sent).and_then(|wiring| wiring.peer(passage.from));
        if let Some(from) = track(passage.from.module)
            && let Some(to) = peer.and_then(|peer| track(peer.module))
        {
            let name = format!("hormone {:?}", passage.data);
            events.flow(&name, (from, passage.sent), (to, arrived));
        }
    }
}

fn half(controller: Controller) -> Half {
    match controller {
        Controller::Master => MASTER,
        Controller::Slave => SLAVE,
    }
}

/// The robot's wiring at `cycle`.
fn wiring_at(recording: &Recording, cycle: u64) -> Option<&Wiring> {
    recording.wirings.iter().rfind(|(since, _)| *since <= cycle).map(|(_, wiring)| wiring)
}
