//! The three behaviours (paper, Figure 5) as tasks that run to completion on one stack: what drives
//! [`Behaviours`] with the kernel's clock.
//!
//! They see the module through [`tasks::api`] alone, run below all system tasks, and are the same in every
//! module.

use kernel::{Mutex, Never, Task, now};
use tasks::api::Api;
use tasks::mailbox::Mailbox;
use tasks::message::Message;
use tasks::post_office::Undelivered;

use crate::behaviours::Behaviours;
use crate::event::Event;
use crate::gait::GaitName;
use crate::module::Module;
use crate::status::Status;
use crate::time::until;

/// The module, for the task that runs.
pub struct Here<'a> {
    pub task: &'a mut Task,
    pub api: Api,
}

impl Module for Here<'_> {
    #[inline(never)] // it stands in many places: flash
    fn send(&mut self, message: Message) -> Result<(), Undelivered> {
        self.api.send(self.task, message)
    }

    #[inline(never)] // for `stack-bound`, which is told where it leads
    fn trace(&mut self, event: Event) {
        self.api.trace(event.to_byte());
    }
}

/// Runs the behaviours on `mailbox`, which takes the messages to all of them, walking by `gait` until told
/// otherwise; see
/// [`Controller::new`](crate::controller::Controller::new) for `seed`. `status` shows HORMONE's view of the
/// module to whoever reads RAM. `alive` is called every [`LOOK`](crate::behaviours::LOOK) ticks or sooner.
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
    let mut behaviours = Behaviours::new(gait.gait(), seed, start);
    let mut alarm = start;
    loop {
        while let Some(message) = mailbox.take(task) {
            let time = now(task);
            behaviours.receive(time, message, &mut Here { task, api });
        }
        let time = now(task);
        if behaviours.poll(time, &mut Here { task, api }) {
            status.with(task, |status| *status = *behaviours.status());
        }
        let time = now(task);
        let next = behaviours.poll_at(time);
        // To set an alarm that is set takes longer than to see that. One that is due now may have gone off.
        if next == time || next != alarm {
            alarm = next;
            mailbox.wake_in(task, until(next, time));
        }
        alive(task);
        mailbox.wait(task);
    }
}
