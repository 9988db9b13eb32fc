//! What an MCU does, over time: who has its CPU, what each task waits for, which interrupts are served.
//!
//! A [`Tracer`] sees it from outside: it looks at each instruction as it was executed, and at what the kernel
//! keeps in SRAM where that instruction changed it. The program does not take a cycle more, and no MCU that
//! is not traced is looked at.
//!
//! - `watch`: which instructions and which bytes of SRAM are looked at.
//! - `kernel`: what the kernel's data say, at addresses that the image's symbols tell.
//! - `names`: what lies where, in the words of the program.
//! - `tracer`: takes note.
//! - `line`: the levels of wires, by what was sent there; `motors`: those of the pins that drive motors.

mod kernel;
mod line;
mod motors;
mod names;
mod tracer;
mod track;
mod watch;

use std::fmt;
use std::sync::Arc;

use thiserror::Error;

use crate::character::Character;
pub(crate) use kernel::Kernel;
pub use line::{BusSignal, Line, bus_lines, serial_line};
pub use motors::motor_lines;
pub(crate) use names::Names;
pub(crate) use tracer::Tracer;
pub use track::Slice;

/// What an MCU did, from power-up to where its run ended. All times are cycles since power-up of the robot.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Who had the CPU: one after the other, without gaps. Interrupts are in here with whatever they
    /// interrupted, as the kernel's own figures have them.
    pub cpu: Vec<Slice<Holder>>,
    /// Interrupts by their vectors, in the order of their begins, from the acceptance to where the handler
    /// returns or leaves the CPU to another task. One that interrupts another lies within that.
    pub interrupts: Vec<Slice<u8>>,
    /// In the order in which they were first ready.
    pub tasks: Vec<TaskTrace>,
    /// By the numbers of the serial ports, as far as anything passed there.
    pub serial: Vec<SerialTrace>,
    pub(crate) registers: Vec<RegisterWrite>,
    /// Where the run ended.
    pub end: u64,
}

/// A register by which motors are driven has been written, or reset.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RegisterWrite {
    pub cycle: u64,
    pub address: u16,
    pub value: u8,
}

/// What passed at a serial port. The last characters may end later than the run.
#[derive(Clone, Debug, Default)]
pub struct SerialTrace {
    pub sent: Vec<Character>,
    /// What came in, whether the program received it or not.
    pub received: Vec<Character>,
}

/// What a task did.
#[derive(Clone, Debug)]
pub struct TaskTrace {
    /// The name of its stack in the program.
    pub name: Arc<str>,
    /// One after the other. Where there is a gap there was no task on this stack.
    pub states: Vec<Slice<TaskState>>,
}

/// Who has the CPU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holder {
    /// Nobody: a reset lasts until supply and crystal have settled.
    Reset,
    /// The program, before the kernel runs.
    Start,
    /// The kernel, as no task is ready.
    Idle,
    /// Nobody: the core sleeps.
    Sleep,
    /// The task with this index in [`Trace::tasks`]: from where the kernel turns to it, so that its context
    /// is loaded in its time, and that of the task before is saved in that one's.
    Task(usize),
}

/// What a task is doing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TaskState {
    /// It has the CPU.
    Running,
    /// It could go on, and another has the CPU.
    Ready,
    Waiting(Wait),
    /// Another task has suspended it, and it does not wait.
    Suspended,
    Killed,
}

/// What a task waits for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wait {
    /// The semaphores or queues, by name; none where it waits for a time alone.
    pub on: Vec<Arc<str>>,
    /// For how many ticks at most, if it is no longer than that.
    pub ticks: Option<u16>,
}

impl fmt::Display for TaskState {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            TaskState::Running => f.write_str("running"),
            TaskState::Ready => f.write_str("ready"),
            TaskState::Suspended => f.write_str("suspended"),
            TaskState::Killed => f.write_str("killed"),
            TaskState::Waiting(Wait { on, .. }) if on.is_empty() => f.write_str("waits for a time"),
            TaskState::Waiting(Wait { on, .. }) => write!(f, "waits for {}", on.join(" or ")),
        }
    }
}

/// An image can't be traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("the image has no {0}, by which a program of this kernel is traced: build it with `./x build`")]
pub struct NotTraceable(pub(crate) &'static str);
