//! Inspects all tasks of a program at one moment: their states, and the registers with which they resume.

use std::sync::Arc;

use crate::cpu::Registers;
use crate::mcu::Mcu;
use crate::trace::{Kernel, Names, NotTraceable, TaskState};

/// The value of stack bytes that were never used, as in `kernel/src/stack_watermark.rs`.
const WATERMARK: u8 = 0xa5;

/// The tasks of a program.
pub struct Tasks {
    names: Names,
    kernel: Kernel,
    all: Vec<Task>,
}

struct Task {
    control_block: u16,
    name: Arc<str>,
    stack: u16,
}

/// A task at one moment.
#[derive(Clone, Debug)]
pub struct Context {
    /// The address of its control block, which identifies it to the kernel.
    pub task: u16,
    /// The name of its stack in the program.
    pub name: Arc<str>,
    pub state: TaskState,
    /// The registers with which it resumes. Those of the MCU, if it has the CPU.
    pub registers: Registers,
    /// Bytes of its stack.
    pub stack: u16,
}

impl Tasks {
    /// The tasks of the program that an MCU runs, in the order of their addresses.
    ///
    /// # Errors
    /// The program has no kernel of ours.
    pub fn of(mcu: &Mcu) -> Result<Self, NotTraceable> {
        let names = Names::of(mcu.image());
        let kernel = Kernel::of(&names, mcu.cpu())?;
        let control_block_bytes = kernel.control_block_bytes();
        let task = |(control_block, name, size): (u16, &str, u16)| {
            Some(Task { control_block, name: name.into(), stack: size.checked_sub(control_block_bytes)? })
        };
        let mut all: Vec<Task> = names.tasks().filter_map(task).collect();
        all.sort_by_key(|task| task.control_block);
        Ok(Self { names, kernel, all })
    }

    /// The tasks that exist now: none before the kernel is initialised. While interrupts are masked, the
    /// kernel's data may be between two states.
    pub fn look(&mut self, mcu: &Mcu) -> Vec<Context> {
        let Self { names, kernel, all } = self;
        let cpu = mcu.cpu();
        if !kernel.is_laid(cpu, |task| all.iter().any(|known| known.control_block == task)) {
            return Vec::new();
        }
        let (running, ready) = (kernel.running(cpu), kernel.ready(cpu));
        let context = |&Task { control_block: task, ref name, stack }: &Task| {
            let state = kernel.state(cpu, task, (running, &ready), names)?;
            let registers = if running == Some(task) { mcu.registers() } else { kernel.saved(cpu, task) };
            Some(Context { task, name: name.clone(), state, registers, stack })
        };
        all.iter().filter_map(context).collect()
    }

    /// How many bytes of its stack a task has ever used.
    pub fn used(&self, mcu: &Mcu, &Context { task, stack, .. }: &Context) -> u16 {
        let begin = task.saturating_add(self.kernel.control_block_bytes());
        let is_unused = |at: &u16| mcu.read(*at) == Some(WATERMARK);
        stack - (begin..begin.saturating_add(stack)).take_while(is_unused).count() as u16
    }
}
