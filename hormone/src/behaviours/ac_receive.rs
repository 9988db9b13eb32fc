//! AC_RECV: derives the topology from the probes that come in, and tells HORMONE of each change.

use tasks::dock::DockSet;
use tasks::message::{Address, Letter, Message, TaskCode};

use super::AdaptiveCommunication;
use crate::module::Module;
use crate::neighbours::{Neighbours, to_bytes};
use crate::probe::Probe;
use crate::time::{reached, until};

/// How often silent neighbours are looked for, in ticks of 1 ms; see
/// [`Topology::expire`](crate::topology::Topology::expire).
pub const LOOK: u16 = 20;

impl AdaptiveCommunication {
    /// Takes in a message from a neighbour. Returns whether AC_SEND has a probe to send at once.
    #[inline(never)]
    pub fn receive(&mut self, now: u16, message: &Letter) -> bool {
        let probe = Probe::from_payload(message.payload());
        let (Some(dock), Some(probe)) = (message.from().dock(), probe) else {
            self.malformed = self.malformed.wrapping_add(1);
            return false;
        };
        let heard = self.topology.heard(dock, probe, now);
        if heard.answer {
            self.schedule.hurry(DockSet::of(&[dock]));
            self.probe_at = now;
        }
        if heard.changed {
            self.is_news = true;
            self.look_at = now;
        }
        if heard.asks {
            self.schedule.urge(dock);
            self.look_at = now;
        }
        heard.answer
    }

    /// Looks for silent neighbours if it is time. Returns the neighbours of which HORMONE is to be
    /// [told](tell), if they have changed, and whether AC_SEND has a probe to send at once.
    #[inline(never)]
    pub fn look(&mut self, now: u16) -> (Option<Neighbours>, bool) {
        if !reached(self.look_at, now) {
            return (None, false);
        }
        self.look_at = now.wrapping_add(LOOK);
        let lost = self.topology.expire(now);
        let is_news = self.is_news | !lost.is_empty();
        self.is_news = false;
        self.schedule.hurry(lost);
        let hurries = self.schedule.set_quick(self.topology.lossy(now), now) | !lost.is_empty();
        if self.schedule.is_urgent() {
            self.schedule.calm(self.topology.silent(now));
        }
        if hurries {
            self.probe_at = now;
        }
        (is_news.then(|| self.topology.neighbours()), hurries)
    }

    /// The message to HORMONE found no room: the next look repeats it.
    pub fn tell_again(&mut self) {
        self.is_news = true;
    }

    /// Milliseconds from `now` until the next [`look`](Self::look).
    pub fn next_look(&self, now: u16) -> u16 {
        until(self.look_at, now)
    }
}

/// Sends the topology to HORMONE. Returns whether there was room.
pub fn tell(neighbours: &Neighbours, module: &mut impl Module) -> bool {
    let to = Address::here(TaskCode::HORMONE);
    let from = Address::here(TaskCode::AC_RECEIVE);
    Message::new(to, from, &to_bytes(neighbours)).is_ok_and(|message| module.send(message).is_ok())
}
