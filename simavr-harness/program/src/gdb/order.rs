//! What gdb's server and the process that runs the robot tell each other: a line of JSON each.

use std::io::{self, BufRead, BufReader, Write};
use std::ops::Range;
use std::os::unix::net::UnixStream;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use simavr_harness::{Context, Mcu, Registers, TaskState, Tasks};

/// What the server wants.
#[derive(Debug, Serialize, Deserialize)]
pub enum Order {
    Go {
        way: Way,
        points: Points,
    },
    /// While the robot runs: to stop where it is.
    Interrupt,
    /// Bytes to the data space.
    Write {
        address: u16,
        bytes: Vec<u8>,
    },
    SetRegisters(Registers),
}

/// Where the MCU is to go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Way {
    Continue,
    Step,
    Back,
    StepBack,
}

/// What stops it on its way.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Points {
    /// Addresses of instructions, in bytes.
    pub breakpoints: Vec<u32>,
    pub watchpoints: Vec<Watchpoint>,
}

/// Bytes of the data space that stop the MCU when something happens to them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Watchpoint {
    pub address: u16,
    pub length: u16,
    pub watched: Watched,
}

/// What that is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Watched {
    Change,
    Read,
    Either,
}

impl Watchpoint {
    /// Whether an instruction that reads these addresses stops the MCU.
    pub fn is_read_by(&self, reads: &Range<u16>) -> bool {
        let end = self.address.saturating_add(self.length);
        self.watched != Watched::Change && reads.start < end && self.address < reads.end
    }

    /// That it has stopped the MCU.
    pub fn reason(&self) -> Reason {
        Reason::Watchpoint(self.address, self.watched)
    }
}

/// Why the MCU has stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reason {
    /// Somebody said so.
    Halt,
    Step,
    Breakpoint,
    /// What is watched from this address on was changed, or read.
    Watchpoint(u16, Watched),
    /// It can't go back further.
    Begin,
    /// The run is over.
    End,
}

/// The MCU has stopped.
#[derive(Debug, Serialize, Deserialize)]
pub struct Report {
    pub reason: Reason,
    pub picture: Picture,
}

/// What gdb may ask of an MCU that has stopped.
#[derive(Debug, Serialize, Deserialize)]
pub struct Picture {
    /// Since power-up of the robot.
    pub cycle: u64,
    pub registers: Registers,
    pub data: Vec<u8>,
    pub tasks: Vec<Task>,
}

#[derive(Debug, Serialize, Deserialize)]
pub struct Task {
    /// By which gdb knows it: the address of its control block.
    pub id: u16,
    pub name: String,
    pub state: String,
    /// It has the CPU.
    pub is_running: bool,
    pub registers: Registers,
}

/// Where the core's registers are in the data space.
const GENERAL: Range<usize> = 0..32;
const STACK_POINTER: usize = 0x5d;
const STATUS: usize = 0x5f;

impl Picture {
    /// What an MCU is like now; `tasks` are its program's.
    pub fn of(mcu: &Mcu, tasks: Option<&mut Tasks>) -> Self {
        let contexts = tasks.map(|tasks| tasks.look(mcu)).unwrap_or_default();
        let tasks = contexts.into_iter().map(|Context { task, name, state, registers, .. }| Task {
            id: task,
            name: name.to_string(),
            is_running: state == TaskState::Running,
            state: state.to_string(),
            registers,
        });
        Self { cycle: mcu.cycle(), registers: mcu.registers(), data: mcu.data(), tasks: tasks.collect() }
    }

    /// The MCU's registers become these.
    pub fn set_registers(&mut self, registers: &Registers) {
        let Registers { general, stack_pointer, status, .. } = registers;
        self.data[GENERAL].copy_from_slice(general);
        self.data[STACK_POINTER..STATUS].copy_from_slice(&stack_pointer.to_le_bytes());
        self.data[STATUS] = *status;
        self.registers = registers.clone();
        if let Some(task) = self.tasks.iter_mut().find(|task| task.is_running) {
            task.registers = registers.clone();
        }
    }

    /// Bytes are written to the data space from `address` on, where registers lie, too. `None`, and nothing
    /// is written, where these go beyond its end.
    pub fn write(&mut self, address: usize, bytes: &[u8]) -> Option<()> {
        self.data.get_mut(address..address + bytes.len())?.copy_from_slice(bytes);
        let mut registers = self.registers.clone();
        registers.general.copy_from_slice(&self.data[GENERAL]);
        registers.stack_pointer =
            u16::from_le_bytes([STACK_POINTER, STACK_POINTER + 1].map(|at| self.data[at]));
        registers.status = self.data[STATUS];
        self.set_registers(&registers);
        Some(())
    }
}

/// One end of a connection that carries such lines.
pub struct Line {
    reader: BufReader<UnixStream>,
}

impl Line {
    pub fn new(stream: UnixStream) -> Self {
        Self { reader: BufReader::new(stream) }
    }

    pub fn stream(&self) -> &UnixStream {
        self.reader.get_ref()
    }

    /// # Errors
    /// Nobody listens any more.
    pub fn send(&self, message: &impl Serialize) -> io::Result<()> {
        let mut line = serde_json::to_vec(message)?;
        line.push(b'\n');
        self.stream().write_all(&line)
    }

    /// Waits for a message; `None` when the other end is gone.
    pub fn receive<M: DeserializeOwned>(&mut self) -> Option<M> {
        let mut line = String::new();
        self.reader.read_line(&mut line).ok().filter(|&length| length > 0)?;
        serde_json::from_str(&line).ok()
    }

    /// Whether there is something to receive, or the other end is gone.
    pub fn is_ready(&self) -> bool {
        !self.reader.buffer().is_empty() || super::process::is_ready(self.stream())
    }
}
