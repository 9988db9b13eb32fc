//! The steps of a script, as values.

use crate::call::Call;

/// The actions of an interrupt.
#[derive(Clone, Debug, PartialEq)]
pub enum Handler {
    Calls(Vec<Call>),
    /// A tick of the clock, and the interrupt inside of it.
    Tick(Option<Box<Interruption>>),
}

/// An interrupt that comes inside of a task's call or of a tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Interruption {
    /// The distance from the beginning of the call or tick, or from the interrupt before. On the host it is
    /// the number of the critical section at whose end the interrupt comes, on an MCU a number of cycles.
    pub after: usize,
    pub handler: Handler,
    pub then: Option<Box<Interruption>>,
}

/// A step, between two calls of the running task or while no task runs.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// The running task calls.
    Call(Call, Option<Interruption>),
    /// An interrupt comes.
    Interrupt(Handler),
    /// While no task runs: so many ticks, or fewer if a task runs before.
    Silence(u16),
}
