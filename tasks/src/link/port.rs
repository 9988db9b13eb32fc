//! What the two tasks of a dock share: its end of the link, its mailbox and its counts.

use kernel::{Context, MaskedCell, Task};

use super::counters::{Counted, LinkCounters};
use super::endpoint::Endpoint;
use super::frame::Label;
use super::sender::Shared;
use crate::counter::Counter;
use crate::dock::Dock;
use crate::mailbox::Mailbox;

/// Messages that may wait at a dock to be sent.
pub const ROOM: u8 = 4;

/// How often a message is repeated before it is given up. Where three frames of four are lost, one message of
/// 420 is given up.
pub const RETRY_LIMIT: u8 = 20;

/// A dock's link. A `static`: its tasks run on it, and readers of RAM find the [`LinkCounters`] at its start.
#[repr(C)]
pub struct Port {
    pub(super) counters: LinkCounters<Counter>,
    endpoint: MaskedCell<Endpoint>,
    mailbox: Mailbox,
    /// The ACK that the receiving task asks the sending task for.
    ack_due: MaskedCell<Option<Label>>,
    dock: Dock,
}

impl Port {
    /// The link at `dock`.
    pub const fn new(dock: Dock) -> Self {
        Port {
            counters: LinkCounters::new(),
            endpoint: MaskedCell::new(Endpoint::new(dock, 0, RETRY_LIMIT)),
            mailbox: Mailbox::new(ROOM),
            ack_due: MaskedCell::new(None),
            dock,
        }
    }

    /// Where messages to the neighbour beyond this dock go.
    pub const fn mailbox(&self) -> &Mailbox {
        &self.mailbox
    }

    /// Its counts, in the order of [`LinkCounters`].
    pub const fn counts(&self) -> &[Counter] {
        self.counters.all()
    }

    /// The link's counts.
    pub fn counters(&self, task: &mut Task) -> LinkCounters {
        self.counters.read(task)
    }

    /// The dock that the link is at.
    pub const fn dock(&self) -> Dock {
        self.dock
    }

    /// Works on this end of the link with interrupts masked, for less than the kernel's longest critical
    /// section. To lock a mutex and release it would take 115 to 290 cycles more.
    #[inline(always)]
    pub(super) fn with<R>(&self, task: &mut Task, work: impl FnOnce(&mut Endpoint) -> R) -> R {
        task.mask(|masked| {
            let mut endpoint = self.endpoint.get(masked);
            let result = work(&mut endpoint);
            self.endpoint.set(masked, endpoint);
            result
        })
    }

    /// Begins anew, with the epochs that `seed` gives; see [`Endpoint::new`].
    pub(super) fn restart(&self, task: &mut Task, seed: u16) {
        self.with(task, |endpoint| *endpoint = Endpoint::new(self.dock, seed, RETRY_LIMIT));
    }

    /// Asks the sending task for an ACK, in place of one not yet sent.
    pub(super) fn acknowledge(&self, task: &mut Task, label: Label) {
        task.mask(|masked| self.ack_due.set(masked, Some(label)));
        self.mailbox.wake(task);
    }

    pub(super) fn take_ack_due(&self, task: &mut Task) -> Option<Label> {
        task.mask(|masked| {
            let label = self.ack_due.get(masked);
            self.ack_due.set(masked, None);
            label
        })
    }
}

/// A port, and the task that works on it.
pub struct AtPort<'a> {
    pub task: &'a mut Task,
    pub port: &'static Port,
}

impl Shared for AtPort<'_> {
    fn endpoint<R>(&mut self, work: impl FnOnce(&mut Endpoint) -> R) -> R {
        self.port.with(self.task, work)
    }

    fn count(&mut self, what: Counted) {
        self.port.counters.of(what).count(self.task);
    }
}
