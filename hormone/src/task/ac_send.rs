//! AC_SEND as a task.

use kernel::{Never, Task, now};
use tasks::api::Api;
use tasks::mailbox::Mailbox;

use super::{Here, Shared};
use crate::behaviours::ac_send::send;

/// Runs AC_SEND on `mailbox`, by which AC_RECV wakes it. Nothing else comes there.
pub fn run(task: &mut Task, mailbox: &'static Mailbox, shared: &'static Shared, api: Api) -> Never {
    loop {
        let time = now(task);
        let (probe, wait) = shared.with(task, |state| state.due_probe(time));
        if let Some(probe) = probe
            && !send(probe, &mut Here { task, api })
        {
            shared.with(task, |state| state.take_back(probe));
        }
        if wait != 0 {
            mailbox.wake_in(task, wait);
            mailbox.wait(task);
        }
    }
}
