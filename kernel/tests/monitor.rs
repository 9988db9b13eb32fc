//! The monitor's commands, on a made-up memory.

mod log;

use std::sync::Mutex;

use kernel::monitor::{self, LINE, Line, Machine, Tasks, obey, refuse_line};
use kernel::{Never, Priority, Refused, Semaphore, Stack, Task, TaskHandle, TaskState, host};
use log::Log;

static NEVER: Semaphore = Semaphore::new(0);

static MONITOR: Stack<0> = Stack::new();
static WAITER: Stack<0> = Stack::new();
static READY: Stack<0> = Stack::new();
static ABSENT: Stack<0> = Stack::new();
static TASKS: Tasks = &[
    ("MONITOR", MONITOR.task()),
    ("WAITER", WAITER.task()),
    ("READY", READY.task()),
    ("ABSENT", ABSENT.task()),
];

/// The address of the made-up contexts of all tasks, and the bottom of their stacks.
const CONTEXT: u16 = 0x0400;
const BOTTOM: u16 = 0x03f0;

struct Fake<'a> {
    task: &'a mut Task,
    memory: Vec<u8>,
    reply: String,
    /// Bit 15 of saved stack pointers.
    is_preempted: bool,
    steps: usize,
}

impl Machine for Fake<'_> {
    fn put(&mut self, byte: u8) {
        self.reply.push(byte.into());
    }

    fn read(&mut self, address: u16) -> u8 {
        self.memory[usize::from(address)]
    }

    fn write(&mut self, address: u16, byte: u8) {
        self.memory[usize::from(address)] = byte;
    }

    fn tasks(&self) -> Tasks {
        TASKS
    }

    fn monitor(&mut self) -> &mut Task {
        self.task
    }

    fn stack_pointer(&mut self, _: TaskHandle) -> u16 {
        if self.is_preempted { CONTEXT | 0x8000 } else { CONTEXT }
    }

    fn stack_bottom(&self, _: TaskHandle) -> u16 {
        BOTTOM
    }

    fn step(&mut self, task: TaskHandle) -> Result<(), Refused> {
        if task.state(self.task) != TaskState::Suspended {
            return Err(Refused::Busy);
        }
        self.steps += 1;
        Ok(())
    }
}

impl Fake<'_> {
    /// The reply to `line`.
    fn says(&mut self, line: &str) -> String {
        obey(line.as_bytes(), self);
        std::mem::take(&mut self.reply)
    }

    /// Asserts that `line` is refused with a message that contains `reason`, and changes nothing.
    fn refuses(&mut self, line: &str, reason: &str) {
        let memory = self.memory.clone();
        let reply = self.says(line);
        assert!(reply.starts_with("? ") && reply.ends_with("\r\n"), "{line}: {reply}");
        assert!(reply.contains(reason), "{line}: {reply}");
        assert!(memory == self.memory, "{line} wrote");
    }
}

#[test]
fn commands_do_what_they_say_and_mistakes_do_nothing() {
    static LOG: Log = Log::new();
    host::run_for(
        1,
        |boot| {
            WAITER.start(boot, Priority::P1, waiter).unwrap();
            MONITOR
                .start(boot, Priority::P3, |task| {
                    let memory = (0..=0xffff).map(|address: u16| address as u8).collect();
                    let mut fake = Fake { task, memory, reply: String::new(), is_preempted: true, steps: 0 };
                    memory_is_read_and_written(&mut fake);
                    mistakes_say_what_to_do(&mut fake);
                    tasks_are_listed(&mut fake);
                    tasks_are_steered(&mut fake);
                    LOG.note("done");
                    waiter(task)
                })
                .unwrap();
            READY.start(boot, Priority::P5, waiter).unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["done"]);
}

fn waiter(task: &mut Task) -> Never {
    loop {
        NEVER.wait(task);
    }
}

fn memory_is_read_and_written(fake: &mut Fake) {
    assert_eq!(fake.says("r 12"), "0012 12\r\n");
    assert_eq!(fake.says("  r  00F0   2 "), "00f0 f0 f1\r\n");
    assert_eq!(fake.says("r abc 11"), "0abc bc bd be bf c0 c1 c2 c3 c4 c5 c6 c7 c8 c9 ca cb\r\n0acc cc\r\n");
    assert_eq!(fake.says("r ffff 2"), "ffff ff 00\r\n", "addresses wrap");
    assert_eq!(fake.says("r 0 ff").lines().count(), 16);
    assert_eq!(fake.says("w 100 1"), "done\r\n");
    assert_eq!(fake.says("w 101 FF 0 a5"), "done\r\n");
    assert_eq!(fake.says("r ff 6"), "00ff ff 01 ff 00 a5 04\r\n");
    // The longest line.
    let line = format!("w 200{}", " 7".repeat(21));
    assert!(line.len() <= LINE);
    assert_eq!(fake.says(&line), "done\r\n");
    assert_eq!(fake.memory[0x200..0x216], [[7; 21].as_slice(), &[0x15]].concat());
}

fn mistakes_say_what_to_do(fake: &mut Fake) {
    assert_eq!(fake.says(""), "");
    assert_eq!(fake.says("  "), "");
    for line in ["q", "L", "list", "\u{fe}", "0", "?"] {
        fake.refuses(line, "h shows all");
    }
    for line in ["r", "w", "w 100", "s", "g", "n", "k", "x", "p", "p READY"] {
        fake.refuses(line, "something is missing");
    }
    for line in ["h 1", "l READY", "r 0 1 2", "s READY 1", "g 1 2", "n 1 2", "k 1 2", "x 1 2", "p 2 3 4"] {
        fake.refuses(line, "too many words");
    }
    for line in ["r 10000", "r g", "r -1", "r 0x10", "w 00000 1", "w r 1"] {
        fake.refuses(line, "4 hexadecimal digits");
    }
    for line in ["r 0 0", "r 0 100", "r 0 x"] {
        fake.refuses(line, "1 to ff");
    }
    for line in ["w 100 1 2 x", "w 100 100", "w 100 1 2 -3"] {
        fake.refuses(line, "nothing was written");
    }
    for line in ["s BLINK", "g 4", "n ready", "k ff", "x 100", "p REA 3"] {
        fake.refuses(line, "l shows all");
    }
    for line in ["p READY 8", "p READY x", "p READY 00"] {
        fake.refuses(line, "0 to 7");
    }
    for line in ["s MONITOR", "k MONITOR", "s 0"] {
        fake.refuses(line, "the monitor itself");
    }
    for line in ["g READY", "g ABSENT", "x READY", "x WAITER"] {
        fake.refuses(line, "s suspends it");
    }
    for line in ["s ABSENT", "k ABSENT", "x ABSENT", "p ABSENT 1"] {
        fake.refuses(line, "no task runs there");
    }
    fake.refuses("n READY", "l shows its state");
    refuse_line(fake);
    assert!(std::mem::take(&mut fake.reply).contains(&format!("up to {LINE} characters")));
    // No byte does harm, anywhere in a line.
    for byte in 0..=0xff {
        for line in [&[byte][..], &[b'r', b' ', byte], &[b's', b' ', byte], &[b'w', b' ', b'1', byte, byte]] {
            obey(line, fake);
            let reply = std::mem::take(&mut fake.reply);
            assert!(reply.is_empty() || reply.ends_with("\r\n"), "{line:?}: {reply}");
        }
    }
    assert!(fake.says("g 2").contains("done"), "`s` and a number suspended it");
    assert!(fake.says("g 1").contains("done"));
}

fn tasks_are_listed(fake: &mut Fake) {
    fake.is_preempted = true;
    assert_eq!(
        fake.says("l"),
        "00 MONITOR ready p3 sp 03ff free 0010\r\n\
         01 WAITER waiting p1 sp 03ff free 0010\r\n\
         02 READY ready p5 sp 03ff free 0010\r\n\
         03 ABSENT not started\r\n"
    );
    fake.is_preempted = false;
    assert!(fake.says("l").contains("02 READY ready p5 sp 0400 free 0011\r\n"));
    let help = fake.says("h");
    for command in ["l", "r ", "w ", "s ", "g ", "n ", "x ", "k ", "p "] {
        assert!(help.lines().any(|line| line.starts_with(command)), "{command}: {help}");
    }
}

fn tasks_are_steered(fake: &mut Fake) {
    assert_eq!(fake.says("s READY"), "done\r\n");
    assert_eq!(READY.task().state(fake.task), TaskState::Suspended);
    assert_eq!(fake.says("p 2 6"), "done\r\n");
    assert_eq!(READY.task().priority(fake.task), Priority::P6);
    assert!(fake.says("l").contains("02 READY suspended p6 "));
    fake.is_preempted = false;
    fake.refuses("x READY", "n, then x");
    fake.is_preempted = true;
    // The made-up memory holds each address's low byte, and the context begins at 0x400.
    let registers = "pc 004244 sp 0422 sreg 9d\r\n\
         r00 1e 1c 0f 0e 0d 0c 0b 0a 09 08 07 06 05 04 03 02\r\n\
         r10 01 00 1b 1a 19 18 17 16 15 14 13 12 11 10 1f 20\r\n";
    assert_eq!(fake.says("x READY"), registers);
    assert_eq!(fake.steps, 0);
    assert_eq!(fake.says("n READY"), registers);
    assert_eq!(fake.steps, 1);
    // A PC in the upper 64 KB of the flash, and RAMPZ in the saved SREG.
    fake.memory[0x421] |= 0x80;
    fake.memory[0x41d] |= 0x80;
    assert_eq!(fake.says("x READY"), registers.replace("pc 00", "pc 01"));
    assert_eq!(fake.says("g READY"), "done\r\n");
    assert_eq!(READY.task().state(fake.task), TaskState::Ready);
    assert_eq!(fake.says("k WAITER"), "done\r\n");
    assert!(fake.says("l").contains("01 WAITER killed p"));
    fake.refuses("k WAITER", "no task runs there");
}

/// A serial line on which is typed what is there, and then nothing more.
struct Scripted {
    typed: std::vec::IntoIter<u8>,
    said: &'static Mutex<String>,
}

impl Line for Scripted {
    fn read(&mut self, task: &mut Task) -> u8 {
        self.typed.next().unwrap_or_else(|| match waiter(task) {})
    }

    fn write(&mut self, _: &mut Task, bytes: &[u8]) {
        self.said.lock().unwrap().extend(bytes.iter().map(|&byte| char::from(byte)));
    }
}

#[test]
fn a_session_obeys_each_line_and_then_shows_a_prompt() {
    static STACK: Stack<0> = Stack::new();
    static ONE: Tasks = &[("ABSENT", ABSENT.task())];
    static SAID: Mutex<String> = Mutex::new(String::new());
    let typed = format!("\r\nl\r\nn 0\r{0}\n{0}x\nk 0\n", "x".repeat(LINE));
    host::run_for(
        0,
        |boot| {
            let body = move |task: &mut Task| {
                let mut line = Scripted { typed: typed.into_bytes().into_iter(), said: &SAID };
                let mut step = |_: &mut Task, _| Err(Refused::Busy);
                // SAFETY: none of these commands writes.
                unsafe { monitor::run(task, &mut line, ONE, &mut step) }
            };
            STACK.start(boot, Priority::P3, body).unwrap();
        },
        |_, _| {},
    );
    assert_eq!(
        *SAID.lock().unwrap(),
        "00 ABSENT not started\r\n> \
         ? not now: it waits, or has a mutex, or is not suspended; l shows its state\r\n> \
         ? no such command: h shows all\r\n> \
         ? the line is too long, up to 48 characters are read: write in pieces\r\n> \
         ? no task runs there: l shows which do\r\n> "
    );
}
