//! The three behaviours as turns of the loop; [`hormone::task`] runs them as tasks.

use hormone::behaviours::AdaptiveCommunication;
use hormone::behaviours::hormone::Behaviour;
use hormone::gait::GaitName;
use hormone::pacemaker::Beats;
use hormone::status::Status;
use hormone::task::Here;
use hormone::task::hormone::ALIVE;
use kernel::{Mutex, Task, Ticks, now};
use tasks::api::Api;
use tasks::mailbox::Mailbox;

/// AC_RECV and AC_SEND.
pub struct Neighbours {
    mailbox: &'static Mailbox,
    api: Api,
    state: AdaptiveCommunication,
}

impl Neighbours {
    /// Both, on the mailbox of AC_RECV.
    pub fn new(task: &mut Task, mailbox: &'static Mailbox, api: Api) -> Self {
        let state = AdaptiveCommunication::new(now(task));
        Neighbours { mailbox, api, state }
    }

    /// Takes a message, if there is one, and does what is due. Returns the time of the next turn if nothing
    /// is posted before.
    #[inline(never)] // its stack is needed here alone
    pub fn turn(&mut self, task: &mut Task) -> Option<Ticks> {
        let time = now(task);
        if let Some(message) = self.mailbox.take(task) {
            self.state.receive(time, &message);
        }
        self.state.poll(time, &mut Here { task, api: self.api });
        Some(time.wrapping_add(self.state.next_due(time)))
    }

    /// Tells AC_RECV the beats that HORMONE expects.
    pub fn expect(&mut self, beats: Option<Beats>) {
        self.state.expect(beats);
    }

    /// Messages that could not be read.
    pub fn malformed(&self) -> u16 {
        self.state.malformed()
    }
}

/// HORMONE.
pub struct Hormones {
    mailbox: &'static Mailbox,
    status: &'static Mutex<Status>,
    api: Api,
    state: Behaviour,
    malformed: u16,
}

impl Hormones {
    /// See [`hormone::task::hormone::run`].
    pub fn new(
        task: &mut Task,
        mailbox: &'static Mailbox,
        gait: GaitName,
        seed: u16,
        status: &'static Mutex<Status>,
        api: Api,
    ) -> Self {
        let state = Behaviour::new(gait.gait(), seed, now(task));
        Hormones { mailbox, status, api, state, malformed: 0 }
    }

    /// Takes a message, if there is one, and does what is due. `unread` is the number of messages that
    /// AC_RECV could not read. Returns the time of the next turn if nothing is posted before.
    #[inline(never)] // its stack is needed here alone
    pub fn turn(&mut self, task: &mut Task, unread: u16) -> Option<Ticks> {
        let time = now(task);
        if let Some(message) = self.mailbox.take(task) {
            self.state.receive(time, message, &mut Here { task, api: self.api });
        }
        let has_acted = self.state.act(time, &mut Here { task, api: self.api });
        if has_acted || unread != self.malformed {
            self.malformed = unread;
            self.status.with(task, |status| *status = self.state.status(unread));
        }
        Some(time.wrapping_add(self.state.next_due(time).min(ALIVE)))
    }

    /// The beats around now; `None` if none is awaited.
    pub fn beats(&self) -> Option<Beats> {
        self.state.controller().beats()
    }
}
