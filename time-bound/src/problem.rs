//! Why there is no bound.

use thiserror::Error;

/// A reason why an execution time can't be computed. Addresses are in bytes, as `avr-objdump` prints them.
#[derive(Clone, Debug, Error, PartialEq, Eq, PartialOrd, Ord)]
pub enum Problem {
    #[error(transparent)]
    Flow(stack_bound::Problem),
    #[error(
        "{function} has loops without a bound, {}; note \"{function} = turns\", in this shape: {shape}",
        addresses(.headers)
    )]
    NotNoted { function: String, headers: Vec<u32>, shape: String },
    #[error(
        "the note of {function} does not fit its loops {}: they have this shape: {shape}", addresses(.headers)
    )]
    Misfit { function: String, headers: Vec<u32>, shape: String },
    #[error("{function} has a note, but no loop: take the note out")]
    NoLoop { function: String },
    #[error("{caller} does not call {callee}: take the note out")]
    NoCall { caller: String, callee: String },
    #[error("the notes of {function} leave no path through it, or one that takes hours: correct them")]
    NoPath { function: String },
    #[error(
        "{function} reads or writes SREG at {address:#x}, in a nested critical section, and its value is \
         unknown"
    )]
    Nested { function: String, address: u32 },
    #[error(
        "the instructions of {function} were not followed, because its use of the stack is noted: its \
         time is unknown"
    )]
    NotFollowed { function: String },
    #[error("interrupt {vector} does not come to an end, or has a loop that is noted as a task's job")]
    NoEnd { vector: u8 },
    #[error("the loop of {function} at {address:#x} can be entered at two places")]
    Irreducible { function: String, address: u32 },
    #[error("{what}: correct the run")]
    Run { what: String },
    #[error(
        "the task {body} is not listed: list it, with the event that it answers or the reason why it has no \
         bound"
    )]
    NotListed { body: String },
    #[error(
        "{task} has neither an event that it answers nor a reason why it has no bound: give it one of them"
    )]
    NoReason { task: String },
    #[error("the image has no task {body}: take it out, or correct the name")]
    NoBody { body: String },
    #[error("interrupt {vector} has a deadline, but the image does not serve it")]
    NoInterrupt { vector: u8 },
    #[error("\"{event}\" belongs to a task {task} that is not listed")]
    NoTask { event: String, task: String },
    #[error("the task {task} answers \"{event}\", which is not listed")]
    NoEvent { task: String, event: String },
    #[error("the task {task} has its jobs in {function}, which has no loop that is noted as a job")]
    NoJob { task: String, function: String },
    #[error(
        "the job of {function} begins at {address:#x} with a call of a function that has jobs, too: note the \
         job of one of them only"
    )]
    JobInJob { function: String, address: u32 },
    #[error("{function} writes to flash at {address:#x}, which takes an unknown time")]
    NoTime { function: String, address: u32 },
}

fn addresses(headers: &[u32]) -> String {
    let headers: Vec<_> = headers.iter().map(|header| format!("{header:#x}")).collect();
    format!("at {}", headers.join(", "))
}
