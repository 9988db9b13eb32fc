//! The console's task, on one of the two MCUs.

use kernel::{Never, Task, Ticks, is_reached, now};

use super::dialogue::Dialogue;
use tasks::counter::Counter;
use tasks::dock::DockSet;
use tasks::mailbox::Mailbox;
use tasks::post_office::{PostOffice, Undelivered};
use tasks::router::Source;

/// Messages that may wait for the console: a request, and an answer.
const ROOM: u8 = 2;

/// How long an answer may take, in ticks of 1 ms. An inspector measures its CPU's load for 50 ms, and runs
/// only in the time that other tasks leave to it.
const PATIENCE: Ticks = 250;

/// The console. A `static` holds it: the console's task uses it, and readers of RAM find the counts at its
/// start.
#[repr(C)]
pub struct Console {
    /// Messages that were valid requests, or answers to its questions. Wraps.
    taken: Counter,
    /// Messages that were neither. Wraps.
    malformed: Counter,
    mailbox: Mailbox,
}

impl Default for Console {
    fn default() -> Self {
        Self::new()
    }
}

impl Console {
    pub const fn new() -> Self {
        Console { taken: Counter::new(), malformed: Counter::new(), mailbox: Mailbox::new(ROOM) }
    }

    /// The mailbox for requests and answers.
    pub const fn mailbox(&self) -> &Mailbox {
        &self.mailbox
    }
}

/// Runs the task of `console`. `slave` has the docks of the slave; the others are the master's.
pub fn run(task: &mut Task, console: &'static Console, slave: DockSet, office: &'static PostOffice) -> Never {
    let mailbox = console.mailbox();
    let mut dialogue = Dialogue::new(slave);
    // When the awaited answer is overdue.
    let mut deadline = 0;
    loop {
        while let Some(letter) = mailbox.take(task) {
            let is_taken = dialogue.receive(letter.from(), letter.payload());
            drop(letter);
            let counter = if is_taken { &console.taken } else { &console.malformed };
            counter.count(task);
        }
        if dialogue.awaits_answer() && is_reached(deadline, now(task)) {
            dialogue.miss_answer();
        }
        if dialogue.has_mail() {
            dialogue.send(|message| office.deliver(task, message, Source::Task) != Err(Undelivered::NoRoom));
            let pause = if dialogue.has_mail() { 1 } else { PATIENCE };
            deadline = now(task).wrapping_add(pause);
            mailbox.wake_in(task, pause);
        }
        mailbox.wait(task);
    }
}
