//! What all tasks of a program do at one moment, and where they go on.

use std::sync::Arc;

use crate::mcu::{Mcu, Registers};
use crate::trace::kernel::Kernel;
use crate::trace::names::Names;
use crate::trace::{NotTraceable, TaskState};

/// The tasks of a program.
pub struct Tasks {
    names: Names,
    kernel: Kernel,
    /// By their control blocks.
    all: Vec<(u16, Arc<str>)>,
}

/// A task at one moment.
#[derive(Clone, Debug)]
pub struct Context {
    /// The address of its control block, by which the kernel knows it.
    pub task: u16,
    /// The name of its stack in the program.
    pub name: Arc<str>,
    pub state: TaskState,
    /// With which it goes on; those of the MCU where it has the CPU.
    pub registers: Registers,
}

impl Tasks {
    /// The tasks of the program that an MCU runs.
    ///
    /// # Errors
    /// The program has no kernel of ours.
    pub fn of(mcu: &Mcu) -> Result<Self, NotTraceable> {
        let names = Names::of(mcu.image());
        let kernel = Kernel::of(&names, mcu.cpu())?;
        let mut all: Vec<(u16, Arc<str>)> = names.tasks().map(|(task, name)| (task, name.into())).collect();
        all.sort();
        Ok(Self { names, kernel, all })
    }

    /// What they do now, as far as there are any: none before the program has begun. The kernel's data may be
    /// between two states, but where interrupts are enabled.
    pub fn look(&mut self, mcu: &Mcu) -> Vec<Context> {
        let cpu = mcu.cpu();
        if !self.kernel.is_laid(cpu, |task| self.all.iter().any(|(known, _)| *known == task)) {
            return Vec::new();
        }
        let running = self.kernel.running(cpu);
        let ready = self.kernel.ready(cpu);
        let mut contexts = Vec::new();
        for (task, name) in &self.all {
            let state = self.kernel.state(cpu, *task, (running, &ready), &mut self.names);
            let has_cpu = running == Some(*task);
            let registers = if has_cpu { mcu.registers() } else { self.kernel.saved(cpu, *task) };
            if let Some(state) = state {
                contexts.push(Context { task: *task, name: name.clone(), state, registers });
            }
        }
        contexts
    }
}
