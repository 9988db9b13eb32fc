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

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::posting::put;
    use crate::question::Question;
    use crate::request::{Request, Topic, piece};
    use kernel::{LONGEST, Priority, Stack, host};
    use std::borrow::ToOwned;
    use std::string::String;
    use std::sync::Mutex;
    use std::vec::Vec;
    use tasks::dock::Dock;
    use tasks::message::{Address, TaskCode};
    use tasks::router::{Mcu, Router};
    use tasks::superbot::RESIDENCE;

    const TERMINAL: Address = Address::beyond(Dock::Up, TaskCode::CONSOLE);

    static CONSOLE: Console = Console::new();
    static DOCK: Mailbox = Mailbox::new(1);
    static MASTER: Mailbox = Mailbox::new(1);
    static SLAVE: Mailbox = Mailbox::new(1);
    static NOBODY: Mailbox = Mailbox::new(0);
    static OFFICE: PostOffice = PostOffice {
        router: Router::new(Mcu::Slave, RESIDENCE),
        tasks: &[(TaskCode::CONSOLE, CONSOLE.mailbox()), (TaskCode::SLAVE_INSPECTOR, &SLAVE)],
        devices: &NOBODY,
        links: &[(Dock::Up, &DOCK)],
        bridge: &MASTER,
    };

    fn tell(task: &mut Task, from: Address, payload: &[u8]) {
        put(task, CONSOLE.mailbox(), Address::here(TaskCode::CONSOLE), from, payload);
    }

    fn ask(task: &mut Task, request: Request) {
        request.with_payload(|payload| tell(task, TERMINAL, payload));
    }

    /// The master is silent, the slave answers late, and the terminal asks for each piece once it has the one
    /// before.
    #[test]
    fn what_is_sent_and_when() {
        static HEARD: Mutex<Vec<(Ticks, String)>> = Mutex::new(Vec::new());
        static COUNTS: Mutex<[u16; 2]> = Mutex::new([0; 2]);
        let script = |task: &mut Task| {
            // The clock begins anew while the first answer is awaited.
            task.delay(LONGEST);
            task.delay(LONGEST);
            let start = now(task);
            ask(task, Request::Begin(Topic::Cpu));
            loop {
                task.delay(1);
                let time = now(task).wrapping_sub(start);
                let note = |what: &str| {
                    HEARD.lock().expect("no test panicked with it").push((time, what.to_owned()))
                };
                match time {
                    100 => tell(task, TERMINAL, b"?"), // the answer is not overdue
                    // For a while there is no room for what the answer leads to.
                    900 => {
                        put(task, &DOCK, Address::here(TaskCode::CONSOLE), TERMINAL, b"");
                        tell(task, TERMINAL, b"?");
                        let inspector = Address::here(TaskCode::SLAVE_INSPECTOR);
                        tell(task, inspector, &[&Question::Mcu.to_payload()[..], &[0, 0, 2, 0]].concat());
                        continue;
                    }
                    901..905 => continue,
                    905 => _ = DOCK.take(task).expect("it is full"),
                    _ => {}
                }
                for (inspector, name) in [(&MASTER, "master?"), (&SLAVE, "slave?")] {
                    if let Some(letter) = inspector.take(task) {
                        assert_eq!(letter.payload(), Question::Mcu.to_payload());
                        note(name);
                    }
                }
                if let Some(letter) = DOCK.take(task) {
                    let (number, text) = piece(letter.payload()).expect("a piece");
                    note(core::str::from_utf8(text).expect("a text"));
                    let is_end = text.is_empty();
                    drop(letter);
                    if !is_end {
                        ask(task, Request::Next(number));
                    }
                }
                let counts = [&CONSOLE.taken, &CONSOLE.malformed].map(|counter| counter.get(task));
                *COUNTS.lock().expect("no test panicked with it") = counts;
            }
        };
        host::run_for(
            u32::from(u16::MAX) + 2_000,
            |boot| {
                static OF_CONSOLE: Stack<4000> = Stack::new();
                static OF_SCRIPT: Stack<4000> = Stack::new();
                let console = |task: &mut Task| run(task, &CONSOLE, RESIDENCE.slave.docks, &OFFICE);
                OF_CONSOLE.start(boot, Priority::P6, console).expect("the stack is free");
                OF_SCRIPT.start(boot, Priority::P5, script).expect("the stack is free");
            },
            |_, _| {},
        );
        let expected = [
            (1, "SuperBot 0.1.0\n"),
            (2, "master?"),
            (252, "master?"),
            (502, "master?"),
            (752, "no answer from "),
            (753, "the master\n"),
            (754, "slave?"),
            (906, "slave: awake fo"),
            (907, "r 100.0 % of 50"),
            (908, " ms, reset by R"),
            (909, "ESET pin\n"),
            (910, ""),
        ];
        let heard = HEARD.lock().expect("no test panicked with it");
        assert_eq!(*heard, expected.map(|(time, what)| (time, what.to_owned())));
        let counts = COUNTS.lock().expect("no test panicked with it");
        assert_eq!(*counts, [9, 2], "taken: a beginning, an answer, and seven times the next piece");
    }
}
