//! How much stack each task of a program for the AVR needs at most, computed from the image that is flashed.
//!
//! # How
//! Every way through the machine code is followed, with what is known of the stack pointer and the registers: pushes,
//! pops, calls, and frames that are made by writing the stack pointer. A function's use is known once that of all it
//! calls is. The compiler could tell the frames of its functions (`-Zemit-stack-sizes`), but not those of assembly,
//! nor which function calls which after link-time optimisation. The image has all of it, as it will run.
//!
//! A task's stack holds, in the worst case, what its closure captured, its functions at their deepest, and one interrupt.
//! That interrupt's handler runs on the kernel's stack, the rest of SRAM, for which the start-up code, `main` and all
//! handlers are followed in the same way. Which tasks there are, the kernel's `Stack::start` writes into a section of
//! the ELF file.
//!
//! # What is taken for granted
//! - A call preserves Y, and pops what it pushed below its return address. (Of functions it follows, the second is checked.)
//! - Nobody writes into pushed registers or return addresses, or to SPL and SPH through a pointer.
//! - An interrupt may strike a task anywhere, but neither a handler nor `main`.
//! - Only `kernel_switch` moves to another task's stack; it comes back to contexts whose stack pointer it has saved. And only
//!   `kernel_expire_timers` moves about on the idle task's.

mod annotations;
mod image;
mod instruction;
mod problem;
mod program;
mod registers;
mod report;
mod state;

pub use annotations::{AnnotationError, Annotations};
pub use image::{Image, ImageError};
pub use problem::Problem;
pub use report::{Stack, Step};

use program::{Program, SWITCH, Use};

/// What a preempted context holds besides the return address, in bytes: all registers and SREG. A test holds this against
/// what is seen in simavr.
const REGISTERS: u32 = 33;

/// The stacks of a program: of its tasks, and of the kernel.
///
/// # Errors
/// All that keeps the use of a stack from being computed.
pub fn stacks(image: &Image, annotations: &Annotations) -> Result<Vec<Stack>, Vec<Problem>> {
    let mut program = Program::new(image, annotations);
    let mut kernel = program.start_up().kernel;
    let mut interrupt = Use::default();
    for vector in image.vectors() {
        let function = program.function(vector);
        interrupt.raise_to(&Use::of("an interrupt", image.return_address.into()).then(&function.own));
        kernel.raise_to(&function.kernel);
    }
    kernel.raise_to(&interrupt); // of the idle task, which uses nothing else
    let mut context = interrupt.clone();
    if image.function(SWITCH).is_some() {
        // The kernel lays down half of a preempted context from another stack: that is not seen on the way.
        context.raise_to(&Use::of("a preempted context", u32::from(image.return_address) + REGISTERS));
        // A tick that strikes the idle task wakes others from below what it has pushed: nor is that seen.
        kernel.raise_to(&interrupt.then(&Use::of("the expiry of timers", image.return_address.into())));
    }
    let mut stacks = Vec::new();
    for task in &image.tasks {
        let function = program.function(task.entry);
        stacks.push(Stack::of_task(image, task, &function.own, &context));
        kernel.raise_to(&function.kernel.then(&interrupt));
    }
    stacks.sort_by(|one, other| one.name.cmp(&other.name));
    stacks.push(Stack::of_kernel(image, kernel));
    if program.problems.is_empty() { Ok(stacks) } else { Err(program.problems.into_iter().collect()) }
}
