//! How much stack each task of a program for the AVR needs at most, computed from the image that is flashed.
//!
//! # How
//! Every path through the machine code is followed, with the known values of the stack pointer and the
//! registers: pushes, pops, calls, and frames that are made by writing the stack pointer. A function's use is
//! known once the use of all its callees is. The compiler could report the frames of its functions
//! (`-Zemit-stack-sizes`), but neither those of assembly nor the calls after link-time optimisation. The
//! image has all of it, as it will run.
//!
//! A task's stack holds, in the worst case, the captures of its closure, its functions at their deepest, and
//! one interrupt, or several where handlers enable interrupts on that stack. The kernel's handlers do not:
//! they run on the kernel's stack, the rest of SRAM. For that stack the start-up code, `main` and all
//! handlers are followed in the same way. There interrupts nest wherever the machine code enables them, also
//! in a handler. So each vector is followed twice: from a task's stack, and from the kernel's stack, on which
//! it stays. The kernel's `Stack::start` lists the tasks in a section of the ELF file.
//!
//! # Critical sections
//! The same paths show a critical section of another crate that a call of the kernel would end early. That is
//! an error, too: the compiler does not notice it, and the section protects nothing behind the call.
//!
//! # Assumptions
//! - A call preserves Y, and pops what it pushed below its return address. (The second is checked for
//!   functions that are followed.)
//! - Where `sbc` takes r1 from the high byte of a pair, r1 is 0, as compilers keep it.
//! - No code writes into pushed registers or return addresses, or to SPL and SPH through a pointer.
//! - An interrupt may occur anywhere in a task; elsewhere only from an instruction that enables interrupts up
//!   to one that masks them. A function that writes SREG writes a value that it has read there, if it has
//!   read any, or one whose interrupt flag it has set or cleared itself; else the write may enable
//!   interrupts. A function whose bytes are noted enables them by `sei` or `reti`, if at all.
//! - While a handler has interrupts enabled within a function, its own interrupt does not reach that function
//!   again: the tick does not expire timers while it expires timers.
//! - Only `kernel_switch` moves to another task's stack; it comes back to contexts whose stack pointer it has
//!   saved. An interrupt compares SP with `__heap_start` to find out whether it has preempted code on a
//!   task's stack.

mod annotations;
pub mod effect;
mod enables;
pub mod flow;
mod image;
mod notes;
mod problem;
mod program;
mod registers;
mod report;
mod sections;
mod state;
pub mod timing;
mod usage;
pub mod vectors;

pub use annotations::{AnnotationError, Annotations};
pub use image::{Image, ImageError};
pub use notes::notes;
pub use problem::Problem;
pub use program::Found;
pub use report::{Stack, Step};

use std::collections::BTreeMap;

use program::{Program, SWITCH};
use registers::StackPointer;
use sections::Sections;
use usage::{Usage, Use};

/// The size of a preempted context besides the return address, in bytes: all registers and SREG. A test
/// compares it with the use seen in simavr.
const REGISTERS: u32 = 33;

/// The stacks of a program: of its tasks, and of the kernel.
///
/// # Errors
/// Each problem that keeps the use of a stack from being computed, and each critical section that a call of
/// the kernel ends early.
pub fn stacks(image: &Image, annotations: &Annotations) -> Result<Vec<Stack>, Vec<Problem>> {
    let mut program = Program::new(image, annotations, Found::Task);
    let mut kernel = program.start_up().kernel;
    let mut on_task = interrupts(&mut program, &mut kernel);
    let mut nested = Program::new(image, annotations, Found::Kernel);
    let on_kernel = interrupts(&mut nested, &mut kernel);
    if image.function(SWITCH).is_some() {
        // The kernel writes half of a preempted context from another stack, so following the code does not
        // show it. A handler that enables interrupts on a task's stack is preempted as the task is.
        let context = Use::of("a preempted context", u32::from(image.return_address) + REGISTERS);
        on_task.deepest.raise_to(&context);
    }
    let context = on_task.nested(|_| true);
    let mut stacks = Vec::new();
    for task in &image.tasks {
        let function = program.function(task.entry);
        stacks.push(Stack::of_task(image, task, &function.own.deepest, &context));
        kernel.raise_to(&function.kernel);
    }
    stacks.sort_by(|one, other| one.name.cmp(&other.name));
    stacks.push(Stack::of_kernel(image, kernel.with(&on_kernel)));
    let mut problems = std::mem::take(&mut program.problems);
    problems.append(&mut nested.problems);
    problems.append(&mut Sections::that_end_early(image, annotations, &program.into_flows()));
    if problems.is_empty() { Ok(stacks) } else { Err(problems.into_iter().collect()) }
}

/// The control flow of all functions that a program's tasks and interrupts reach, by their start addresses.
/// Interrupts find the stack that `found` names.
///
/// # Errors
/// Each problem that keeps a function from being followed.
pub fn flows(
    image: &Image,
    annotations: &Annotations,
    found: Found,
) -> Result<BTreeMap<u32, flow::Flow>, Vec<Problem>> {
    let mut program = Program::new(image, annotations, found);
    let entries: Vec<_> = image.vectors().chain(image.tasks.iter().map(|task| task.entry)).collect();
    for entry in entries {
        program.function(entry);
    }
    if !program.problems.is_empty() {
        return Err(program.problems.into_iter().collect());
    }
    Ok(program.into_flows())
}

/// How many bytes a function has put on its stack since it was called, by the address of the instruction that
/// it reaches. An address is left out if paths lead there with different numbers, or if it can't be followed.
/// In the entry function of a task the number is -1: nothing has called that function.
pub fn depths(image: &Image) -> BTreeMap<u32, i32> {
    let annotations = Annotations::default();
    let mut program = Program::new(image, &annotations, Found::Task);
    let tasks: Vec<_> = image.tasks.iter().map(|task| task.entry).collect();
    for entry in image.vectors().chain(tasks.iter().copied()) {
        program.function(entry);
    }
    let mut depths = BTreeMap::new();
    for (entry, flow) in program.into_flows() {
        for &(address, stack_pointer) in flow.nodes.keys() {
            let depth = match stack_pointer {
                StackPointer::Own(_) if tasks.contains(&entry) => Some(-1),
                StackPointer::Own(depth) => Some(depth).filter(|&depth| depth >= 0),
                StackPointer::Fixed(_) | StackPointer::Elsewhere => None,
            };
            let known = depths.entry(address).or_insert(depth);
            if *known != depth {
                *known = None;
            }
        }
    }
    depths.into_iter().filter_map(|(address, depth)| Some((address, depth?))).collect()
}

/// The use that interrupts make of the stack that they find. `kernel` is raised to their use of the kernel's
/// stack, once they have moved there.
fn interrupts(program: &mut Program, kernel: &mut Usage) -> Usage {
    let mut usage = Usage::default();
    // Several vectors may have one handler.
    for (vector, handler) in program.image.vectors().enumerate() {
        let function = program.function(handler);
        let own = function.own.of_handler(vector);
        usage.raise_to_call("an interrupt", program.image.return_address.into(), &own);
        kernel.raise_to(&function.kernel.of_handler(vector));
    }
    usage
}
