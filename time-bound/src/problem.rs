//! Why there is no bound.

use thiserror::Error;

/// A reason why an execution time can't be computed. Addresses are in bytes, as `avr-objdump` prints them.
#[derive(Clone, Debug, Error, PartialEq, Eq, PartialOrd, Ord)]
pub enum Problem {
    #[error(transparent)]
    Flow(stack_bound::Problem),
    #[error(
        "nobody says how often the loops of {function} go round, {}; note \"{function} = turns\", in this shape: \
         {shape}",
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
    #[error("what is noted of {function} leaves no way through it")]
    NoPath { function: String },
    #[error(
        "nobody can tell what SREG holds that {function} reads or writes at {address:#x}, in a nested section"
    )]
    Nested { function: String, address: u32 },
    #[error(
        "what {function} does was not followed, for its use of the stack is noted: how long it takes nobody \
         knows"
    )]
    NotFollowed { function: String },
    #[error("interrupt {vector} does not come to an end, or has a loop that is noted as a task's job")]
    NoEnd { vector: u8 },
    #[error("the loop of {function} at {address:#x} can be entered at two places")]
    Irreducible { function: String, address: u32 },
    #[error("{what}: correct what is said of it")]
    Run { what: String },
    #[error("nobody says when the task {body} runs: list it, with what it answers or why it has no bound")]
    NotListed { body: String },
    #[error(
        "{task} has neither an event that it answers nor a reason why it has no bound: give it one of them"
    )]
    NoReason { task: String },
    #[error("the image has no task {body}: take it out, or correct the name")]
    NoBody { body: String },
    #[error("interrupt {vector} has a deadline, and the image does not serve it")]
    NoInterrupt { vector: u8 },
    #[error("\"{event}\" is of a task {task} that is not listed")]
    NoTask { event: String, task: String },
    #[error("the task {task} answers \"{event}\", which is not listed")]
    NoEvent { task: String, event: String },
    #[error("the task {task} has its jobs in {function}, which has no loop that is noted as one")]
    NoJob { task: String, function: String },
    #[error("the job of {function} begins at {address:#x} with a call of what has jobs, too: note one")]
    JobInJob { function: String, address: u32 },
    #[error("{function} writes to flash at {address:#x}, which takes nobody knows how long")]
    NoTime { function: String, address: u32 },
}

fn addresses(headers: &[u32]) -> String {
    let headers: Vec<_> = headers.iter().map(|header| format!("{header:#x}")).collect();
    format!("at {}", headers.join(", "))
}
