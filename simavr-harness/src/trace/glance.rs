//! What an MCU's tasks do at a moment, by what the kernel keeps in SRAM then.

use std::sync::Arc;

use crate::image::{Image, Place};
use crate::mcu::Mcu;
use crate::trace::kernel::{Kernel, word};
use crate::trace::names::Names;
use crate::trace::{NotTraceable, TaskState};

/// What a program lists its tasks in: for each the address of its stack, and the bytes of that.
const TASKS: &str = "::TASKS";

/// What bytes of a stack hold that were never used, as `kernel/src/stack_watermark.rs` has it.
const WATERMARK: u8 = 0xa5;

/// A task at a moment.
#[derive(Clone, Debug)]
pub struct Glimpse {
    /// The name of its stack in the program.
    pub name: Arc<str>,
    /// `None` where there is no task on the stack.
    pub state: Option<TaskState>,
    /// Bytes of its stack, and how many of them it has ever used.
    pub stack: u16,
    pub used: u16,
}

/// Looks at MCUs with one image.
pub struct Glance {
    kernel: Kernel,
    names: Names,
    /// Where control blocks and the stacks behind them begin, and the bytes of these.
    tasks: Vec<(u16, u16, u16)>,
}

impl Glance {
    /// At MCUs with the image of this one.
    ///
    /// # Errors
    /// It runs no program of this kernel, or one that does not list its tasks.
    pub fn of(mcu: &Mcu, image: &Image) -> Result<Self, NotTraceable> {
        let names = Names::of(image);
        let kernel = Kernel::of(&names, mcu.cpu())?;
        let lists = names.places(|path| path.ends_with(TASKS));
        let data = image.symbols().filter_map(|(_, symbol)| match symbol.place {
            Place::Data(start) => Some((start, symbol.size)),
            _ => None,
        });
        let variables: Vec<(u16, u16)> = data.collect();
        let tasks = lists.flat_map(|(start, size)| (start..start + size).step_by(4)).filter_map(|at| {
            let [control, bytes] = [at, at + 2].map(|at| word(mcu.cpu(), at));
            let behind = control.checked_add(kernel.control_block_bytes())?;
            // Else it is no list of tasks, or not yet one.
            let is_stack = variables.contains(&(control, bytes.checked_add(kernel.control_block_bytes())?));
            is_stack.then_some((control, behind, bytes))
        });
        let tasks: Vec<_> = tasks.collect();
        if tasks.is_empty() { Err(NotTraceable(TASKS)) } else { Ok(Self { kernel, names, tasks }) }
    }

    /// What the tasks of an MCU do now, in the order in which the program lists them.
    pub fn tasks(&mut self, mcu: &Mcu) -> Vec<Glimpse> {
        let Self { kernel, names, tasks } = self;
        let cpu = mcu.cpu();
        let (ready, running) = (kernel.ready(cpu), kernel.chosen(cpu));
        let glimpse = |&(control, stack, bytes): &(u16, u16, u16)| {
            let state = kernel.state(cpu, control, (running, &ready), names);
            let is_unused = |&at: &u16| mcu.read(at) == Some(WATERMARK);
            let unused = (stack..stack + bytes).take_while(is_unused).count() as u16;
            Glimpse { name: names.name(control), state, stack: bytes, used: bytes - unused }
        };
        tasks.iter().map(glimpse).collect()
    }
}
