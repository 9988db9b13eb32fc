//! The three behaviours of a module (paper, Figure 5) as state machines. They take messages and the time, and
//! give messages and events to a [`Module`].
//!
//! [`Behaviours`] holds all three for a caller that drives them one after the other. The caller hands over
//! [each message](Behaviours::receive) to a behaviour as it comes, and [polls](Behaviours::poll) after
//! messages and at [`poll_at`](Behaviours::poll_at). On the MCU each behaviour has [a task of its
//! own](crate::task).

pub mod ac_receive;
pub mod ac_send;
mod docks;
pub mod hormone;
mod joints;

use tasks::message::{Held, TaskCode};

use crate::controller::Controller;
use crate::gait::Gait;
use crate::module::Module;
use crate::pacemaker::Beats;
use crate::schedule::Schedule;
use crate::status::Status;
use crate::time::until;
use crate::topology::Topology;

/// The state that AC_SEND and AC_RECV share: the topology and the schedule of probes.
pub struct AdaptiveCommunication {
    topology: Topology,
    schedule: Schedule,
    /// When AC_SEND next checks whether a dock is to be probed.
    probe_at: u16,
    /// When AC_RECV next looks for silent neighbours.
    look_at: u16,
    /// Whether HORMONE has yet to be told of a change of the topology.
    is_news: bool,
    /// Messages to AC_RECV that were no probes.
    malformed: u16,
}

impl AdaptiveCommunication {
    /// A module that has heard nothing, at `now`.
    pub const fn new(now: u16) -> Self {
        AdaptiveCommunication {
            topology: Topology::new(),
            schedule: Schedule::new(now),
            probe_at: now,
            look_at: now,
            is_news: false,
            malformed: 0,
        }
    }

    /// Looks for silent neighbours, tells HORMONE of changes, and probes docks: each if it is due.
    pub fn poll(&mut self, now: u16, module: &mut impl Module) {
        if let (Some(neighbours), _) = self.look(now)
            && !ac_receive::tell(&neighbours, module)
        {
            self.tell_again();
        }
        while let (Some(probe), _) = self.due_probe(now) {
            if !ac_send::send(probe, module) {
                self.take_back(probe);
            }
        }
    }

    /// Milliseconds from `now` until [`poll`](Self::poll) has something to do.
    pub fn next_due(&self, now: u16) -> u16 {
        self.next_look(now).min(until(self.probe_at, now))
    }

    /// Sets the beats that HORMONE expects: AC_SEND [keeps its probes out of their way](Schedule::expect).
    pub fn expect(&mut self, beats: Option<Beats>) {
        self.schedule.expect(beats);
    }

    /// Messages to AC_RECV that could not be read, and were ignored. Wraps.
    pub fn malformed(&self) -> u16 {
        self.malformed
    }
}

/// AC_SEND, AC_RECV and HORMONE.
pub struct Behaviours {
    adaptive_communication: AdaptiveCommunication,
    hormone: hormone::Behaviour,
}

impl Behaviours {
    /// A module at power-up, at `now`, that walks by `gait` until told otherwise; see
    /// [`Controller::new`](crate::controller::Controller::new) for `seed`.
    pub fn new(gait: Gait, seed: u16, now: u16) -> Self {
        Behaviours {
            adaptive_communication: AdaptiveCommunication::new(now),
            hormone: hormone::Behaviour::new(gait, seed, now),
        }
    }

    /// Handles a message to a behaviour, which is taken at `now`.
    pub fn receive(&mut self, now: u16, message: impl Held, module: &mut impl Module) {
        if message.letter().to().task() == TaskCode::HORMONE {
            self.hormone.receive(now, message, module);
        } else {
            self.adaptive_communication.receive(now, message.letter());
        }
    }

    /// Does what is due. Returns whether HORMONE has acted, by which the [`status`](Self::status) may have
    /// changed.
    #[inline(never)] // keeps its stack frame out of the caller's
    pub fn poll(&mut self, now: u16, module: &mut impl Module) -> bool {
        let has_acted = self.hormone.act(now, module);
        if has_acted {
            self.adaptive_communication.expect(self.hormone.controller().beats());
        }
        self.adaptive_communication.poll(now, module);
        has_acted
    }

    /// When to poll even if no message comes.
    #[inline(never)] // as `poll`
    pub fn poll_at(&self, now: u16) -> u16 {
        let wait = self.hormone.next_due(now).min(self.adaptive_communication.next_due(now));
        now.wrapping_add(wait)
    }

    /// The state by which HORMONE decides.
    pub fn controller(&self) -> &Controller {
        self.hormone.controller()
    }

    /// HORMONE's view of the module.
    pub fn status(&self) -> Status {
        self.hormone.status(self.adaptive_communication.malformed)
    }
}

#[cfg(test)]
mod tests;
