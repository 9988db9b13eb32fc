//! AC_RECV: keeps the topology out of the probes that come in, and tells HORMONE of each change.

use tasks::message::{Address, Letter, Message, TaskCode};

use super::AdaptiveCommunication;
use crate::module::Module;
use crate::probe::Probe;
use crate::time::reached;
use crate::topology::to_bytes;

/// How often silent neighbours are looked for, in ticks of 1 ms; see
/// [`Topology::expire`](crate::topology::Topology::expire).
pub const LOOK: u16 = 20;

impl AdaptiveCommunication {
    /// Takes in a message from a neighbour. `None` if it is no probe.
    #[inline(never)]
    pub fn receive(&mut self, now: u16, message: &Letter) -> Option<()> {
        let dock = message.from().dock()?;
        let probe = Probe::from_payload(message.payload())?;
        let heard = self.topology.heard(dock, probe, now);
        if heard.answer {
            self.schedule.hurry(dock);
            self.probe_at = now;
        }
        if heard.changed {
            self.is_news = true;
            self.look_at = now;
        }
        Some(())
    }

    /// Looks for silent neighbours if it is time, and tells HORMONE what is new.
    #[inline(never)]
    pub(super) fn look(&mut self, now: u16, module: &mut impl Module) {
        if reached(self.look_at, now) {
            self.look_at = now.wrapping_add(LOOK);
            self.is_news |= self.topology.expire(now);
            self.schedule.set_quick(self.topology.lossy(now), now);
            self.probe_at = now;
            if self.is_news {
                // What finds no room now is told at the next look.
                self.is_news = !self.tell(module);
            }
        }
    }

    /// Sends the topology to HORMONE. Returns whether that is done.
    fn tell(&self, module: &mut impl Module) -> bool {
        let to = Address::here(TaskCode::HORMONE);
        let from = Address::here(TaskCode::AC_RECEIVE);
        Message::new(to, from, &to_bytes(&self.topology.neighbours()))
            .is_ok_and(|message| module.send(message).is_ok())
    }
}
