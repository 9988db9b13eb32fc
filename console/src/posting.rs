//! Puts messages into mailboxes, for tests.

use kernel::Task;
use tasks::mailbox::Mailbox;
use tasks::message::{Address, Letter, Message};

pub fn put(task: &mut Task, mailbox: &Mailbox, to: Address, from: Address, payload: &[u8]) {
    let message = Message::new(to, from, payload).expect("it is short");
    let letter = kernel::Message::new(task, Letter::of(message)).expect("there is a buffer");
    assert!(mailbox.put(task, letter).is_ok());
}
