//! What a module itself says of itself, read out of its RAM by name, as a debugger would.

use hormone::module_type::ModuleType;
use hormone::status::Status;
use hormone::topology::Neighbours;
use simavr_harness::{Controller, Face, Mcu, Robot};
use tasks::bridge::protocol::BridgeCounters;
use tasks::dock::Dock;
use tasks::link::counters::LinkCounters;

/// The docks' links on either MCU, by symbol.
const LINKS: [&str; 2] = ["LINK_USART0", "LINK_USART1"];

/// A module's view of itself. `None` where the image lacks the symbol or its RAM holds no such value.
pub fn status(robot: &Robot, module: usize) -> Option<Status> {
    let bytes = robot.module(module)?.mcu(Controller::Master).read_symbol("MODULE_STATUS").ok()?;
    Status::from_bytes(bytes.first_chunk()?)
}

/// The neighbours that the wiring gives a module.
pub fn wiring(robot: &Robot, module: usize) -> Neighbours {
    Dock::ALL.map(|dock| robot.neighbour(Face { module, dock }).map(|face| face.dock))
}

/// Whether a module sees its neighbours, and its own type, as they are.
pub fn is_right(robot: &Robot, module: usize) -> bool {
    let wiring = wiring(robot, module);
    status(robot, module).is_some_and(|status| {
        status.neighbours() == Some(wiring) && status.module_type == ModuleType::of(&wiring)
    })
}

/// The counts of all links of an MCU.
pub fn links(mcu: &Mcu) -> impl Iterator<Item = LinkCounters> + '_ {
    LINKS.iter().filter_map(|name| Some(link_counters(&words(mcu, name)?)))
}

/// The counts of an MCU's side of the bridge.
pub fn bridge(mcu: &Mcu) -> Option<BridgeCounters> {
    let [messages_sent, messages_received, retries, errors, gave_up, ignored, no_buffer, freed] =
        words(mcu, "BRIDGE")?;
    Some(BridgeCounters {
        messages_sent,
        messages_received,
        retries,
        errors,
        gave_up,
        ignored,
        no_buffer,
        freed,
    })
}

fn link_counters(words: &[u16; 11]) -> LinkCounters {
    let [
        frames_sent,
        frames_received,
        retries,
        errors,
        duplicates,
        gave_up,
        reflections,
        ignored,
        refused,
        no_buffer,
        overruns,
    ] = *words;
    LinkCounters {
        frames_sent,
        frames_received,
        retries,
        errors,
        duplicates,
        gave_up,
        reflections,
        ignored,
        refused,
        no_buffer,
        overruns,
    }
}

/// The first `N` little-endian words of a variable.
fn words<const N: usize>(mcu: &Mcu, name: &str) -> Option<[u16; N]> {
    let bytes = mcu.read_symbol(name).ok()?;
    let mut words = bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
    let mut result = [0; N];
    for word in &mut result {
        *word = words.next()?;
    }
    Some(result)
}
