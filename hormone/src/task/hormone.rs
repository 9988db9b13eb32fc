//! HORMONE as a task.

use kernel::{Mutex, Never, Task, now};
use tasks::api::Api;
use tasks::mailbox::Mailbox;

use super::{Here, Shared};
use crate::behaviours::hormone::Behaviour;
use crate::gait::GaitName;
use crate::status::Status;
use crate::time::{reached, until};

/// The longest time between two calls of `alive`, in ticks of 1 ms.
pub const ALIVE: u16 = 50;

/// Runs HORMONE on `mailbox`, walking by `gait` until told otherwise; see
/// [`Controller::new`](crate::controller::Controller::new) for `seed`. `status` shows its view of the module
/// to a reader of the RAM. `alive` is called every [`ALIVE`] ticks or sooner.
pub fn run(
    task: &mut Task,
    mailbox: &'static Mailbox,
    gait: GaitName,
    seed: u16,
    (shared, status): (&'static Shared, &'static Mutex<Status>),
    api: Api,
    mut alive: impl FnMut(&mut Task),
) -> Never {
    let mut hormone = Behaviour::new(gait.gait(), seed, now(task));
    let mut malformed = 0;
    let mut alarm = now(task);
    loop {
        while let Some(message) = mailbox.take(task) {
            let time = now(task);
            hormone.receive(time, message, &mut Here { task, api });
        }
        let time = now(task);
        let has_acted = hormone.act(time, &mut Here { task, api });
        if has_acted || reached(alarm, time) {
            let beats = hormone.controller().beats();
            let unread = shared.with(task, |state| {
                state.expect(beats);
                state.malformed()
            });
            if has_acted || unread != malformed {
                malformed = unread;
                status.with(task, |status| *status = hormone.status(malformed));
            }
        }
        let time = now(task);
        let left = hormone.next_due(time).min(ALIVE);
        // An alarm that rings too soon does no harm. Setting it anew with each message would take 400 cycles.
        if left < until(alarm, time) || reached(alarm, time) {
            mailbox.wake_in(task, left);
            alarm = time.wrapping_add(left);
        }
        alive(task);
        mailbox.wait(task);
    }
}
