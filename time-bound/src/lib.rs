//! How long each interrupt of a program for the AVR takes at most, how long interrupts are masked, and how
//! long the noted jobs of tasks compute. All of it is computed from the image that is flashed.
//!
//! # How
//! The control flow is the one that [`stack_bound`] follows: each path through each function and its callees.
//! The cycles of each instruction are in [`stack_bound::timing`], which a test compares with simavr for every
//! opcode. The longest path through a function is found by implicit path enumeration: how often each edge is
//! taken is a variable of a linear program, whose optimum is the bound. The machine code does not show how
//! often loops go round at most. That is [noted](Notes), and a loop without a note is an error that names it.
//!
//! [`Releases`] list how often each event comes, and the code that it runs. From that follows how soon tasks
//! [respond](Responses).
//!
//! The same paths, followed from where interrupts are masked to where they are enabled, show how long they
//! are masked.
//!
//! # Assumptions
//! - The assumptions of [`stack_bound`] hold, and the notes are true.
//! - A function that restores SREG restores the value that it found: each critical section ends in the
//!   function in which it began. (For nested sections that is checked.)
//! - After a return from an interrupt the program executes an instruction, which may mask interrupts. That
//!   happens once while an interrupt waits, or while one waits that is to wake a task.
//! - Tasks leave `sleep` to the kernel's idle task: a job that sleeps has no path to its end.
//! - Start-up, until the first task runs, is not covered.

mod bounds;
mod costed;
mod costs;
mod execution;
mod facts;
mod latency;
mod limits;
mod masked;
mod nest;
mod notes;
mod paths;
mod problem;
mod releases;
mod response;
mod ways;

pub use bounds::{Bounds, Interrupt, Job, Task};
pub use costs::Costs;
pub use latency::Latency;
pub use limits::{Limit, limits};
pub use notes::{NoteError, Notes};
pub use problem::Problem;
pub use releases::{Deadline, Event, ReleaseError, Releases, Run, Task as ReleasedTask};
pub use response::{Load, Response, Responses};
