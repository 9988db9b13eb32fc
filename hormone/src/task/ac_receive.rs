//! AC_RECV: keeps the topology out of the probes that come in, and tells HORMONE of each change.

use kernel::{Task, Ticks, now};
use tasks::api::Api;
use tasks::message::{Address, Letter, Message, TaskCode};

use super::AdaptiveCommunication;
use crate::probe::Probe;
use crate::time::reached;
use crate::topology::to_bytes;

/// How often silent neighbours are looked for, in ticks of 1 ms; see
/// [`Topology::expire`](crate::topology::Topology::expire).
pub const LOOK: Ticks = 20;

/// Takes in a message from a neighbour. `None` if it is no probe.
#[inline(never)]
pub fn receive(task: &mut Task, message: &Letter, shared: &mut AdaptiveCommunication) -> Option<()> {
    let dock = message.from().dock()?;
    let probe = Probe::from_payload(message.payload())?;
    let heard = shared.topology.heard(dock, probe, now(task));
    if heard.answer {
        shared.schedule.hurry(dock);
        shared.probe_at = now(task);
    }
    if heard.changed {
        shared.is_news = true;
        shared.look_at = now(task);
    }
    Some(())
}

/// Looks for silent neighbours if it is time, and tells HORMONE what is new. Returns when it will be time
/// again.
#[inline(never)]
pub fn look(task: &mut Task, shared: &mut AdaptiveCommunication, api: Api) -> Ticks {
    let time = now(task);
    if reached(shared.look_at, time) {
        shared.look_at = time.wrapping_add(LOOK);
        shared.is_news |= shared.topology.expire(time);
        shared.schedule.set_quick(shared.topology.lossy(time), time);
        shared.probe_at = time;
        if shared.is_news {
            // What finds no room now is told at the next look.
            shared.is_news = !tell(task, shared, api);
        }
    }
    shared.look_at
}

/// Sends the topology to HORMONE. Returns whether that is done.
fn tell(task: &mut Task, shared: &AdaptiveCommunication, api: Api) -> bool {
    let to = Address::here(TaskCode::HORMONE);
    let from = Address::here(TaskCode::AC_RECEIVE);
    Message::new(to, from, &to_bytes(&shared.topology.neighbours()))
        .is_ok_and(|message| api.send(task, message).is_ok())
}
