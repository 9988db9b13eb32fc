//! AC_SEND: probes the six docks, again and again.

use kernel::{Task, Ticks, now};
use tasks::api::Api;
use tasks::message::{Address, Message, TaskCode};

use super::AdaptiveCommunication;
use crate::time::reached;

/// Probes the docks whose time has come. Returns when the next one's will.
#[inline(never)]
pub fn probe(task: &mut Task, shared: &mut AdaptiveCommunication, api: Api) -> Ticks {
    let time = now(task);
    if !reached(shared.probe_at, time) {
        return shared.probe_at;
    }
    while let Some(dock) = shared.schedule.due(time) {
        let probe = shared.topology.probe(dock, time);
        let to = Address::beyond(dock, TaskCode::AC_RECEIVE);
        let from = Address::here(TaskCode::AC_RECEIVE);
        if let Ok(message) = Message::datagram(to, from, &[probe.to_byte()]) {
            // One that finds no room is lost like one on the wire: the next probe makes up for it.
            let _ = api.send(task, message);
        }
    }
    shared.probe_at = time.wrapping_add(shared.schedule.next_due(time));
    shared.probe_at
}
