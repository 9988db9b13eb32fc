//! The console: what both MCUs of the module tell of their tasks, stacks, CPUs and links, as text for whoever
//! asks at a dock.
//!
//! It is a behaviour, so any dock reaches it: a terminal in place of a neighbour sends it a [`request`] and
//! gets the text in pieces, one for each that it asks for. So the console never has more than one message
//! under way, and a terminal that vanishes leaves nothing behind. To a neighbour's console a piece is no
//! request.
//!
//! It reads and no more: what it tells it asks the inspectors of both MCUs.
//!
//! | file | what |
//! |---|---|
//! | [`question`] | what an inspector is asked, and what it answers |
//! | [`inspector`] | the inspector: the lowest task of its MCU |
//! | [`request`] | what a terminal sends, and the pieces that it gets |
//! | [`line`](mod@line) | a line of text |
//! | [`report`] | which questions are to be asked, and which lines follow from the answers |
//! | [`dialogue`] | when a piece or a question is sent, and again |
//! | [`task`] | the console's task |

#![no_std]

pub mod dialogue;
pub mod inspector;
pub mod line;
pub mod question;
pub mod report;
pub mod request;
pub mod task;
