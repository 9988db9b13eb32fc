//! AC_SEND: probes the six docks, again and again.

use kernel::{Never, Task, now};
use tasks::api::Api;
use tasks::message::{Address, Message, TaskCode};

use super::AdaptiveCommunication;

/// Runs AC_SEND.
pub fn run(task: &mut Task, shared: &'static AdaptiveCommunication, api: Api) -> Never {
    loop {
        let time = now(task);
        let probe = shared.with(task, |state| {
            let dock = state.schedule.due(time)?;
            Some((dock, state.topology.probe(dock, time)))
        });
        let Some((dock, probe)) = probe else {
            let wait = shared.with(task, |state| state.schedule.next_due(time));
            shared.timer.start(task, wait, &shared.wake);
            shared.wake.wait(task);
            continue;
        };
        let to = Address::beyond(dock, TaskCode::AC_RECEIVE);
        let from = Address::here(TaskCode::AC_RECEIVE);
        if let Ok(message) = Message::datagram(to, from, &[probe.to_byte()]) {
            // One that finds no room is lost like one on the wire: the next probe makes up for it.
            let _ = api.send(task, message);
        }
    }
}
