//! AC_RECV as a task.

use kernel::{Never, Task, now};
use tasks::api::Api;
use tasks::mailbox::Mailbox;

use super::{Here, Shared};
use crate::behaviours::ac_receive::tell;

/// Runs AC_RECV on `mailbox`; `sender` is that of AC_SEND.
pub fn run(
    task: &mut Task,
    mailbox: &'static Mailbox,
    sender: &'static Mailbox,
    shared: &'static Shared,
    api: Api,
) -> Never {
    loop {
        let mut hurries = false;
        while let Some(message) = mailbox.take(task) {
            let time = now(task);
            hurries |= shared.with(task, |state| state.receive(time, &message));
        }
        let time = now(task);
        let ((news, asks), wait) = shared.with(task, |state| (state.look(time), state.next_look(time)));
        if let Some(neighbours) = news
            && !tell(&neighbours, &mut Here { task, api })
        {
            shared.with(task, |state| state.tell_again());
        }
        if hurries || asks {
            sender.wake(task);
        }
        // An alarm that is set already is never later than that.
        mailbox.wake_within(task, wait);
        mailbox.wait(task);
    }
}
