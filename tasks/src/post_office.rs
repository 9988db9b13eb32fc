//! Delivery on one MCU: from a message's address to a task's mailbox.

use kernel::{Message as Owned, Task};

use crate::dock::Dock;
use crate::mailbox::Mailbox;
use crate::message::{Address, Letter, Message, TaskCode};
use crate::router::{Route, Router, Source};

/// The mailboxes of one MCU, and the router that chooses among them.
pub struct PostOffice {
    pub router: Router,
    /// The tasks here that have a mailbox of their own.
    pub tasks: &'static [(TaskCode, &'static Mailbox)],
    /// The mailbox that serves all other tasks here that can be addressed: the devices.
    pub devices: &'static Mailbox,
    /// The sending tasks of the docks here.
    pub links: &'static [(Dock, &'static Mailbox)],
    pub bridge: &'static Mailbox,
}

/// Why a message was not delivered. It is gone, and its buffer free again.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Undelivered {
    /// There is no such task or dock in this module.
    Ignored,
    /// A neighbour may not send this.
    Refused,
    /// The pool is empty or the mailbox full: it may work later.
    NoRoom,
}

impl PostOffice {
    /// Writes `message` into a buffer, and puts that into the mailbox that its address names.
    ///
    /// # Errors
    /// [`Undelivered`]; the caller counts it.
    pub fn deliver(&self, task: &mut Task, message: Message, source: Source) -> Result<(), Undelivered> {
        let mailbox = self.mailbox(message.to(), source)?;
        let mut letter = Owned::new(task, Letter::blank()).map_err(|_| Undelivered::NoRoom)?;
        letter.write(message);
        mailbox.put(task, letter).map_err(|_| Undelivered::NoRoom)
    }

    fn mailbox(&self, to: Address, source: Source) -> Result<&'static Mailbox, Undelivered> {
        match self.router.route(to, source) {
            Route::Task(code) => {
                find(self.tasks, |named| named == code).or((!code.is_behaviour()).then_some(self.devices))
            }
            Route::Link(dock) => find(self.links, |named| named == dock),
            Route::Bridge => Some(self.bridge),
            Route::Ignored => None,
            Route::Refused => return Err(Undelivered::Refused),
        }
        .ok_or(Undelivered::Ignored)
    }
}

fn find<Name: Copy>(
    mailboxes: &[(Name, &'static Mailbox)],
    is_it: impl Fn(Name) -> bool,
) -> Option<&'static Mailbox> {
    mailboxes.iter().find(|(name, _)| is_it(*name)).map(|(_, mailbox)| *mailbox)
}
