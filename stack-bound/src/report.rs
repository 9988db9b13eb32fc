//! The report on a stack.

use std::fmt::{self, Display, Formatter};

use crate::Image;
use crate::image::Task;
use crate::usage::Use;

/// The size of the context from which a task starts, besides the return address, in bytes. It is gone when
/// the task runs.
const FIRST_CONTEXT: u16 = 4;

/// A stack, and its deepest chain of calls. It prints as a line, and one more for each step.
#[derive(Clone, Debug)]
pub struct Stack {
    /// The task that runs on it, or "kernel".
    pub name: String,
    /// Where the task's code begins, in bytes of flash; 0 for the kernel.
    pub entry: u32,
    /// Bytes.
    pub size: u16,
    /// The deepest chain, from the top down.
    pub steps: Vec<Step>,
}

/// A function on the way to where a stack is deepest.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    pub name: String,
    /// Its frame there and, if it calls the next one, the return address.
    pub bytes: u32,
}

impl Stack {
    pub(crate) fn of_task(image: &Image, task: &Task, own: &Use, interrupt: &Use) -> Self {
        let mut deepest = Use::of("its first context", (FIRST_CONTEXT + image.return_address).into());
        deepest.raise_to(own);
        let steps = Use::of("captured", task.captured.into()).then(&deepest).then(interrupt);
        Stack {
            name: image.body(task.entry).to_owned(),
            entry: task.entry,
            size: task.stack,
            steps: printed(steps),
        }
    }

    pub(crate) fn of_kernel(image: &Image, deepest: Use) -> Self {
        let size = (image.stack + 1).saturating_sub(image.variables_end);
        Stack { name: "kernel".to_owned(), entry: 0, size, steps: printed(deepest) }
    }

    /// How many bytes the stack must have.
    pub fn needs(&self) -> u32 {
        self.steps.iter().map(|step| step.bytes).sum()
    }

    pub fn is_too_small(&self) -> bool {
        self.needs() > self.size.into()
    }
}

/// The steps that use at least a byte.
fn printed(steps: Use) -> Vec<Step> {
    steps.0.into_iter().filter(|step| step.bytes != 0).collect()
}

impl Display for Stack {
    fn fmt(&self, formatter: &mut Formatter) -> fmt::Result {
        let spare = i64::from(self.size) - i64::from(self.needs());
        write!(formatter, "{}: {} bytes, needs {}, {spare} to spare", self.name, self.size, self.needs())?;
        self.steps.iter().try_for_each(|step| write!(formatter, "\n{:6}  {}", step.bytes, step.name))
    }
}
