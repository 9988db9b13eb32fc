//! The messages between gdb's server and the process that runs the robot, each a line of JSON.

use std::io::{self, BufRead, BufReader, Write};
use std::ops::Range;
use std::os::unix::net::UnixStream;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use simavr_harness::{Context, Mcu, Registers, TaskState, Tasks};

/// An order of the server.
#[derive(Debug, Serialize, Deserialize)]
pub enum Order {
    Go {
        way: Way,
        points: Points,
    },
    /// Stop where it is; sent while the robot runs.
    Interrupt,
    /// Write bytes to the data space.
    Write {
        address: u16,
        bytes: Vec<u8>,
    },
    SetRegisters(Registers),
}

/// How the MCU is to resume.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Way {
    Continue,
    Step,
    Back,
    StepBack,
}

/// The points that stop it on its way.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Points {
    /// Addresses of instructions, in bytes.
    pub breakpoints: Vec<u32>,
    pub watchpoints: Vec<Watchpoint>,
}

/// Bytes of the data space that stop the MCU when they are changed or read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Watchpoint {
    pub address: u16,
    pub length: u16,
    pub watched: Watched,
}

/// The accesses that stop the MCU.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Watched {
    Change,
    Read,
    Either,
}

impl Watchpoint {
    /// Whether an instruction that reads the addresses `reads` stops the MCU.
    pub fn is_read_by(&self, reads: &Range<u16>) -> bool {
        let end = self.address.saturating_add(self.length);
        self.watched != Watched::Change && reads.start < end && self.address < reads.end
    }

    /// The reason that tells that this watchpoint has stopped the MCU.
    pub fn reason(&self) -> Reason {
        Reason::Watchpoint(self.address, self.watched)
    }
}

/// Why the MCU has stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reason {
    /// The server interrupted it, or the start of the session is reached.
    Halt,
    Step,
    Breakpoint,
    /// The watched bytes from this address on were changed or read.
    Watchpoint(u16, Watched),
    /// It can't go back further.
    Begin,
    /// The run is over.
    End,
}

/// Reports that the MCU has stopped.
#[derive(Debug, Serialize, Deserialize)]
pub struct Report {
    pub reason: Reason,
    pub picture: Picture,
}

/// The state of a stopped MCU, as far as gdb may ask for it.
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
    /// The address of its control block, which identifies it to gdb.
    pub id: u16,
    pub name: String,
    pub state: String,
    /// It has the CPU.
    pub is_running: bool,
    pub registers: Registers,
}

/// Addresses of the core's registers in the data space.
const GENERAL: Range<usize> = 0..32;
const STACK_POINTER: usize = 0x5d;
const STATUS: usize = 0x5f;

impl Picture {
    /// The present state of an MCU. `tasks` are the tasks of its program.
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

    /// Sets the MCU's registers.
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

    /// Writes bytes to the data space from `address` on; registers change with it. Returns `None`, and writes
    /// nothing, if the bytes go beyond its end.
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

/// One end of a connection that carries messages.
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
    /// The other end is gone.
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
