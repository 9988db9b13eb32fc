//! AC_SEND: probes the six docks, again and again.

use tasks::message::{Address, Message, TaskCode};

use super::AdaptiveCommunication;
use crate::module::Module;
use crate::probe::Probe;
use crate::time::{reached, until};

impl AdaptiveCommunication {
    /// A probe that is due, if any, and the milliseconds from `now` until the next may be: 0 for at once.
    #[inline(never)]
    pub fn due_probe(&mut self, now: u16) -> (Option<Probe>, u16) {
        let mut probe = None;
        if reached(self.probe_at, now) {
            probe = self.schedule.due(now).map(|dock| self.topology.probe(dock, now));
            self.probe_at = now.wrapping_add(self.schedule.next_due(now));
        }
        (probe, until(self.probe_at, now))
    }

    /// Takes back a probe that was due but was not [sent](send).
    pub fn take_back(&mut self, probe: Probe) {
        self.topology.take_back(probe.dock);
    }
}

/// Sends a probe by its dock. Returns whether there was room. The next probe makes up for one that is lost.
pub fn send(probe: Probe, module: &mut impl Module) -> bool {
    let to = Address::beyond(probe.dock, TaskCode::AC_RECEIVE);
    let from = Address::here(TaskCode::AC_RECEIVE);
    Message::datagram(to, from, &[probe.to_byte()]).is_ok_and(|message| module.send(message).is_ok())
}
