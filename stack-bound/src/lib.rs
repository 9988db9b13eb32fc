//! How much stack each task of a program for the AVR needs at most, computed from the image that is flashed.
//!
//! # How
//! Every way through the machine code is followed, with what is known of the stack pointer and the registers:
//! pushes, pops, calls, and frames that are made by writing the stack pointer. A function's use is known once
//! that of all it calls is. The compiler could tell the frames of its functions (`-Zemit-stack-sizes`), but
//! not those of assembly, nor which function calls which after link-time optimisation. The image has all of
//! it, as it will run.
//!
//! A task's stack holds, in the worst case, what its closure captured, its functions at their deepest, and
//! one interrupt. That interrupt's handler runs on the kernel's stack, the rest of SRAM, for which the
//! start-up code, `main` and all handlers are followed in the same way. There interrupts nest wherever the
//! machine code enables them, and in a handler, too. So each vector is followed twice: from a task's stack,
//! and from the kernel's, where it stays. Which tasks there are, the kernel's `Stack::start` writes into a
//! section of the ELF file.
//!
//! # What is taken for granted
//! - A call preserves Y, and pops what it pushed below its return address. (Of functions it follows, the
//!   second is checked.)
//! - Nobody writes into pushed registers or return addresses, or to SPL and SPH through a pointer.
//! - An interrupt may occur anywhere in a task; elsewhere only from an instruction that enables interrupts up
//!   to one that masks them. Whoever writes SREG writes what he has read there.
//! - Where a function enables interrupts in a handler, none of those that occur comes to the same place: the
//!   tick does not expire timers while it expires timers.
//! - Only `kernel_switch` moves to another task's stack; it comes back to contexts whose stack pointer it has
//!   saved. An interrupt compares SP with `__heap_start` to know whether it has found a task's stack.

mod annotations;
pub mod effect;
pub mod flow;
mod image;
mod problem;
mod program;
mod registers;
mod report;
mod state;
pub mod timing;
mod usage;
pub mod vectors;

pub use annotations::{AnnotationError, Annotations};
pub use image::{Image, ImageError};
pub use problem::Problem;
pub use program::Found;
pub use report::{Stack, Step};

use std::collections::BTreeMap;

use program::{Program, SWITCH};
use registers::StackPointer;
use usage::{Usage, Use};

/// What a preempted context holds besides the return address, in bytes: all registers and SREG. A test holds
/// this against what is seen in simavr.
const REGISTERS: u32 = 33;

/// The stacks of a program: of its tasks, and of the kernel.
///
/// # Errors
/// All that keeps the use of a stack from being computed.
pub fn stacks(image: &Image, annotations: &Annotations) -> Result<Vec<Stack>, Vec<Problem>> {
    let mut program = Program::new(image, annotations, Found::Task);
    let mut kernel = program.start_up().kernel;
    let on_task = interrupts(&mut program, &mut kernel);
    let mut nested = Program::new(image, annotations, Found::Kernel);
    let on_kernel = interrupts(&mut nested, &mut kernel);
    let mut context = on_task.nested(|_| true);
    if image.function(SWITCH).is_some() {
        // The kernel lays down half of a preempted context from another stack: that is not seen on the way.
        context.raise_to(&Use::of("a preempted context", u32::from(image.return_address) + REGISTERS));
    }
    let mut stacks = Vec::new();
    for task in &image.tasks {
        let function = program.function(task.entry);
        stacks.push(Stack::of_task(image, task, &function.own.deepest, &context));
        kernel.raise_to(&function.kernel);
    }
    stacks.sort_by(|one, other| one.name.cmp(&other.name));
    stacks.push(Stack::of_kernel(image, kernel.with(&on_kernel)));
    program.problems.append(&mut nested.problems);
    if program.problems.is_empty() { Ok(stacks) } else { Err(program.problems.into_iter().collect()) }
}

/// The control flow of all functions that a program's tasks and interrupts reach, by where they begin.
/// Interrupts find the stack that `found` says.
///
/// # Errors
/// All that keeps a function from being followed.
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

/// How many bytes a function has laid on its stack since it was called, by the address of the instruction to
/// which it comes: where that is one number, whichever way leads there. Of a function in which a task begins
/// -1: nothing has called it. What can't be followed is left out.
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

/// What interrupts use of the stack that they find; and `kernel` is raised to what they use of the kernel's
/// when they move there.
fn interrupts(program: &mut Program, kernel: &mut Usage) -> Usage {
    let mut usage = Usage::default();
    for vector in program.image.vectors() {
        let function = program.function(vector);
        usage.raise_to_call("an interrupt", program.image.return_address.into(), &function.own);
        kernel.raise_to(&function.kernel);
    }
    usage
}
