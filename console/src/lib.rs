//! The console reports on the tasks, stacks, CPUs and links of both MCUs of the module, as text for a
//! terminal at any dock.
//!
//! It is a behaviour, so any dock reaches it: a terminal in place of a neighbour sends it a [`request`] and
//! gets the text in pieces, one for each request. So the console never has more than one message under way,
//! and a terminal that vanishes leaves nothing behind. A neighbour's console does not take a piece for a
//! request.
//!
//! It only reads: it gets its data from the inspectors of both MCUs.
//!
//! | file | what |
//! |---|---|
//! | [`question`] | questions to an inspector, and its answers |
//! | [`inspector`] | the inspector: the lowest task of its MCU |
//! | [`request`] | requests of a terminal, and the pieces that it gets |
//! | [`line`](mod@line) | a line of text |
//! | [`report`] | which questions to ask, and the lines that the answers make |
//! | [`dialogue`] | when a piece or a question is sent, and sent again |
//! | [`task`] | the console's task |

#![no_std]

pub mod dialogue;
pub mod inspector;
pub mod line;
#[cfg(test)]
mod posting;
pub mod question;
pub mod report;
pub mod request;
pub mod task;
