//! AC_RECV: keeps the topology out of the probes that come in, and tells HORMONE of each change.

use kernel::{Never, Task, Ticks, now};
use tasks::api::Api;
use tasks::mailbox::Mailbox;
use tasks::message::{Address, Buffered, Message, TaskCode};

use super::AdaptiveCommunication;
use crate::probe::Probe;
use crate::topology::to_bytes;

/// How often silent neighbours are looked for, in ticks of 1 ms; see [`Topology::expire`](crate::topology::Topology::expire).
pub const LOOK: Ticks = 20;

/// Runs AC_RECV on `mailbox`.
pub fn run(
    task: &mut Task,
    mailbox: &'static Mailbox,
    shared: &'static AdaptiveCommunication,
    api: Api,
) -> Never {
    let mut is_news = false;
    let mut next_look = now(task);
    loop {
        while let Some(message) = mailbox.take(task) {
            is_news |= hear(task, &message, shared);
        }
        let time = now(task);
        if crate::time::reached(next_look, time) {
            next_look = time.wrapping_add(LOOK);
            is_news |= shared.with(task, |state| state.topology.expire(time));
            shared.quicken(task, time);
            mailbox.wake_in(task, LOOK);
        }
        if is_news {
            // What finds no room now is told at the next look.
            is_news = !tell(task, shared, api);
        }
        mailbox.wait(task);
    }
}

/// Takes in a probe. Returns whether it changed the topology.
fn hear(task: &mut Task, message: &Buffered, shared: &'static AdaptiveCommunication) -> bool {
    let probe = message.from().dock().zip(Probe::from_payload(message.payload()));
    let Some((dock, probe)) = probe else {
        shared.with(task, |state| state.malformed = state.malformed.wrapping_add(1));
        return false;
    };
    let time = now(task);
    let heard = shared.with(task, |state| state.topology.heard(dock, probe, time));
    if heard.answer {
        shared.hurry(task, dock);
    }
    heard.changed
}

/// Sends the topology to HORMONE. Returns whether that is done.
fn tell(task: &mut Task, shared: &'static AdaptiveCommunication, api: Api) -> bool {
    let neighbours = shared.with(task, |state| state.topology.neighbours());
    let to = Address::here(TaskCode::HORMONE);
    let from = Address::here(TaskCode::AC_RECEIVE);
    Message::new(to, from, &to_bytes(&neighbours)).is_ok_and(|message| api.send(task, message).is_ok())
}
