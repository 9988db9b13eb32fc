//! AC_SEND: probes the six docks, again and again.

use tasks::message::{Address, Message, TaskCode};

use super::AdaptiveCommunication;
use crate::module::Module;
use crate::time::reached;

impl AdaptiveCommunication {
    /// Probes the docks whose time has come.
    #[inline(never)]
    pub(super) fn probe(&mut self, now: u16, module: &mut impl Module) {
        if !reached(self.probe_at, now) {
            return;
        }
        while let Some(dock) = self.schedule.due(now) {
            let probe = self.topology.probe(dock, now);
            let to = Address::beyond(dock, TaskCode::AC_RECEIVE);
            let from = Address::here(TaskCode::AC_RECEIVE);
            if let Ok(message) = Message::datagram(to, from, &[probe.to_byte()]) {
                // One that finds no room is lost like one on the wire: the next probe makes up for it.
                let _ = module.send(message);
            }
        }
        self.probe_at = now.wrapping_add(self.schedule.next_due(now));
    }
}
