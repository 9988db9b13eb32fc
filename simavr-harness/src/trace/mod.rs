//! Traces an MCU over time: which task has its CPU, what each task waits for, which interrupts are served.
//!
//! A [`Tracer`] observes from outside. It looks at each executed instruction, and reads the kernel's data in
//! SRAM if that instruction changed them. The program does not take a cycle more, and an MCU that is not
//! traced costs nothing.
//!
//! - `watch`: the instructions and registers that are watched.
//! - `kernel`: reads the kernel's data, at addresses from the image's symbols.
//! - `names`: the program's names for addresses.
//! - `tracer`: records the trace.
//! - `line`: the levels of wires, from what was sent; `motors`: those of the pins that drive motors.

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

/// The trace of an MCU from power-up to the end of its run. All times are cycles since power-up of the robot.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// The holders of the CPU, one after the other, without gaps. An interrupt counts to the holder that it
    /// interrupted, as in the kernel's own figures.
    pub cpu: Vec<Slice<Holder>>,
    /// Interrupts by their vectors, in the order of their begins. Each lasts from the acceptance until the
    /// handler returns or leaves the CPU to another task. A nested interrupt lies within the one that it
    /// interrupts.
    pub interrupts: Vec<Slice<u8>>,
    /// In the order in which they were first ready.
    pub tasks: Vec<TaskTrace>,
    /// By the numbers of the serial ports, up to the last one that carried anything.
    pub serial: Vec<SerialTrace>,
    pub(crate) registers: Vec<RegisterWrite>,
    /// The cycle at which the run ended.
    pub end: u64,
}

/// A write to a register that drives motors, or its reset.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RegisterWrite {
    pub cycle: u64,
    pub address: u16,
    pub value: u8,
}

/// The characters at a serial port. The last ones may end later than the run.
#[derive(Clone, Debug, Default)]
pub struct SerialTrace {
    pub sent: Vec<Character>,
    /// The characters that came in, whether the program received them or not.
    pub received: Vec<Character>,
}

/// The trace of a task.
#[derive(Clone, Debug)]
pub struct TaskTrace {
    /// The name of its stack in the program.
    pub name: Arc<str>,
    /// Its states, one after the other. In a gap there was no task on this stack.
    pub states: Vec<Slice<TaskState>>,
}

/// The holder of the CPU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holder {
    /// None: a reset lasts until supply and crystal have settled.
    Reset,
    /// The program, before the kernel runs.
    Start,
    /// The kernel, because no task is ready.
    Idle,
    /// None: the core sleeps.
    Sleep,
    /// The task with this index in [`Trace::tasks`], from the point where the kernel turns to it. Loading its
    /// context counts to it; saving the context of the task before counts to that task.
    Task(usize),
}

/// The state of a task.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TaskState {
    /// It has the CPU.
    Running,
    /// It could run, but another task has the CPU.
    Ready,
    Waiting(Wait),
    /// Another task has suspended it, and it does not wait.
    Suspended,
    Killed,
}

/// The wait of a task.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wait {
    /// The names of the semaphores or queues that it waits for; none if it waits for a time only.
    pub on: Vec<Arc<str>>,
    /// The ticks until the wait ends by itself; `None` for a wait without a time limit.
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
#[error("the image has no {0}, which a trace of the kernel needs: build it with `./x build`")]
pub struct NotTraceable(pub(crate) &'static str);
