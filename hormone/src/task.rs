//! The three behaviours (paper, Figure 5) as tasks that run to completion on one stack: thin shells around
//! the pure parts of this crate.
//!
//! They see the module through [`tasks::api`] alone, run below all system tasks, and are the same in every
//! module. Each is called with a message to it and when its time has come, does what there is to do, and says
//! when that will be next.

pub mod ac_receive;
pub mod ac_send;
pub mod docks;
pub mod hormone;
pub mod joints;

use kernel::{Mutex, Never, Task, Ticks, now};
use tasks::api::Api;
use tasks::mailbox::Mailbox;
use tasks::message::TaskCode;

use crate::gait::GaitName;
use crate::schedule::Schedule;
use crate::status::Status;
use crate::time::until;
use crate::topology::Topology;

/// What AC_SEND and AC_RECV share: the topology, and when which dock is probed.
pub struct AdaptiveCommunication {
    topology: Topology,
    schedule: Schedule,
    /// When AC_SEND sees whether a dock is to be probed.
    probe_at: Ticks,
    /// When AC_RECV looks for silent neighbours.
    look_at: Ticks,
    /// Whether HORMONE does not know the topology yet.
    is_news: bool,
}

impl AdaptiveCommunication {
    /// A module that has heard nothing, at `now`.
    #[inline(never)] // else a copy of it would stay on the stack
    pub fn new(now: Ticks) -> Self {
        AdaptiveCommunication {
            topology: Topology::new(),
            schedule: Schedule::new(now),
            probe_at: now,
            look_at: now,
            is_news: false,
        }
    }
}

/// Runs the behaviours on `mailbox`, which takes the messages to all of them, walking by `gait` until told
/// otherwise; see
/// [`Controller::new`](crate::controller::Controller::new) for `seed`. `status` shows HORMONE's view of the
/// module to whoever reads RAM. `alive` is called every [`LOOK`](ac_receive::LOOK) ticks or sooner.
pub fn run(
    task: &mut Task,
    mailbox: &'static Mailbox,
    gait: GaitName,
    seed: u16,
    status: &'static Mutex<Status>,
    api: Api,
    mut alive: impl FnMut(&mut Task),
) -> Never {
    let start = now(task);
    let mut hormone = hormone::Behaviour::new(gait, seed, start);
    let mut shared = AdaptiveCommunication::new(start);
    let mut alarm = start;
    loop {
        while let Some(message) = mailbox.take(task) {
            if message.to().task() == TaskCode::HORMONE {
                hormone.receive(task, message, api);
            } else if ac_receive::receive(task, &message, &mut shared).is_none() {
                hormone.malformed(task);
            }
        }
        let beat = hormone.act(task, status, api);
        let look = ac_receive::look(task, &mut shared, api);
        let probe = ac_send::probe(task, &mut shared, api);
        let time = now(task);
        let wait = until(beat, time).min(until(look, time)).min(until(probe, time));
        let next = time.wrapping_add(wait);
        // To set an alarm that is set takes longer than to see that. One that is due now may have gone off.
        if wait == 0 || next != alarm {
            alarm = next;
            mailbox.wake_in(task, wait);
        }
        alive(task);
        mailbox.wait(task);
    }
}
