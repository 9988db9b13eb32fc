//! What happens in a script, as values.

use crate::call::Call;

/// What an interrupt does.
#[derive(Clone, Debug, PartialEq)]
pub enum Handler {
    Calls(Vec<Call>),
    /// A tick of the clock, and what occurs inside of it.
    Tick(Option<Box<Interruption>>),
}

/// An interrupt that comes inside of a task's call or of a tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Interruption {
    /// From the beginning, or from the interrupt before: masked sections on the host, at the end of which it
    /// comes; cycles on an MCU.
    pub after: usize,
    pub handler: Handler,
    pub then: Option<Box<Interruption>>,
}

/// What happens next, between two calls of the running task or while none runs.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// The running task calls.
    Call(Call, Option<Interruption>),
    /// An interrupt comes.
    Interrupt(Handler),
    /// While no task runs: so many ticks, or until one does.
    Silence(u16),
}
