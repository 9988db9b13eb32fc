//! The module as its behaviours reach it. Their messages leave, and what they do happens, when programs on an
//! MCU would have come to it.

use hormone::event::Event;
use hormone::module::Module;
use tasks::dock::Dock;
use tasks::message::{Kind, Letter, Message, TaskCode};
use tasks::post_office::Undelivered;
use tasks::router::{Mcu, Source};

use super::inside::{Input, Inside};
use super::port::Port;
use super::time::{ACT, NEXT, TELL};

/// A module as its behaviours see it.
pub struct Here<'a> {
    pub inside: &'a mut Inside,
    pub ports: &'a [Port; 6],
    pub events: &'a mut Vec<(u64, Event)>,
    /// When the behaviours come to what they do next.
    pub at: u64,
    /// Whether HORMONE has sent something in this turn.
    pub has_acted: bool,
}

impl Here<'_> {
    /// How long the behaviours take to send this.
    fn takes(&mut self, message: &Message) -> u64 {
        match (message.to().dock(), message.to().task()) {
            (Some(_), TaskCode::HORMONE) if std::mem::replace(&mut self.has_acted, true) => NEXT,
            (Some(_), TaskCode::HORMONE) => ACT,
            (_, task) if task.is_behaviour() => TELL,
            _ => 0,
        }
    }

    /// Whether the mailbox of a dock has room for a message of this kind beside what is on its way there.
    fn has_room(&self, dock: Dock, kind: Kind) -> bool {
        let is_coming = |input: &Input| matches!(input, Input::Sent(to, _) if *to == dock);
        let coming = self.inside.inputs().filter(|input| is_coming(input)).count();
        self.ports[usize::from(dock.index())].has_room(kind, coming)
    }
}

impl Module for Here<'_> {
    fn send(&mut self, message: Message) -> Result<(), Undelivered> {
        self.at += self.takes(&message);
        match self.inside.deliver(self.at, Mcu::Master, message, Source::Task)? {
            Some(dock) if !self.has_room(dock, message.kind()) => Err(Undelivered::NoRoom),
            Some(dock) => {
                self.inside.post(self.at, Input::Sent(dock, Letter::of(message)));
                Ok(())
            }
            None => Ok(()),
        }
    }

    fn trace(&mut self, event: Event) {
        self.events.push((self.at, event));
    }
}
