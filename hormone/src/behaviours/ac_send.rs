//! AC_SEND: probes the six docks, again and again.

use tasks::message::{Address, Message, TaskCode};

use super::AdaptiveCommunication;
use crate::module::Module;
use crate::probe::Probe;
use crate::time::{reached, until};

impl AdaptiveCommunication {
    /// A probe whose time has come, and the milliseconds from `now` until there may be one to ask for: 0 for
    /// at once.
    #[inline(never)]
    pub fn due_probe(&mut self, now: u16) -> (Option<Probe>, u16) {
        let mut probe = None;
        if reached(self.probe_at, now) {
            probe = self.schedule.due(now).map(|dock| self.topology.probe(dock, now));
            self.probe_at = now.wrapping_add(self.schedule.next_due(now));
        }
        (probe, until(self.probe_at, now))
    }
}

/// Sends a probe by its dock.
pub fn send(probe: Probe, module: &mut impl Module) {
    let to = Address::beyond(probe.dock, TaskCode::AC_RECEIVE);
    let from = Address::here(TaskCode::AC_RECEIVE);
    if let Ok(message) = Message::datagram(to, from, &[probe.to_byte()]) {
        // One that finds no room is lost like one on the wire: the next probe makes up for it.
        let _ = module.send(message);
    }
}
