//! How long each interrupt of a program for the AVR takes at most, how long interrupts are masked, and how
//! long tasks compute that are noted, computed from the image that is flashed.
//!
//! # How
//! The control flow is that which [`stack_bound`] follows: each way through each function, with what it
//! calls. What each instruction takes is in [`stack_bound::timing`], which a test holds against simavr
//! for every opcode. The longest way through a function is found by implicit path enumeration: how often
//! each edge is taken is a variable of a linear program, whose optimum is the bound. What bounds loops from
//! above the machine code does not tell: that is [noted](Notes), and a loop without a note is an error that
//! names it.
//!
//! What comes how often is noted, too: by [`Releases`], with what each event has run. From that follows how
//! soon tasks [respond](Responses).
//!
//! The same ways, followed from where interrupts are masked to where they are enabled, tell for how long
//! that is.
//!
//! # What is taken for granted
//! - All that [`stack_bound`] takes for granted, and that the notes are true.
//! - SREG is restored as the function found it that restores it: each critical section ends in the function
//!   in which it began. (Where another one nests in it, that is checked.)
//! - After a return from an interrupt the program executes an instruction, which may mask interrupts. That
//!   happens once while an interrupt waits, or one that is to wake a task.
//! - Start-up, until the first task runs, is not looked at.

mod bounds;
mod costed;
mod costs;
mod execution;
mod facts;
mod latency;
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
pub use notes::{NoteError, Notes};
pub use problem::Problem;
pub use releases::{Deadline, Event, ReleaseError, Releases, Run, Task as ReleasedTask};
pub use response::{Load, Response, Responses};
