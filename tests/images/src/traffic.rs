//! Messages of 16 bytes with their number in each byte: one MCU sends them, another counts those that come in
//! order.

use kernel::{Context, MaskedCell, Never, Task, Ticks};
use tasks::mailbox::Mailbox;
use tasks::message::{Address, MAX_PAYLOAD, Message};
use tasks::post_office::PostOffice;
use tasks::router::Source;

/// How many messages came in order, and how many did not.
pub struct Counts {
    pub in_turn: &'static MaskedCell<u16>,
    pub out_of_turn: &'static MaskedCell<u16>,
}

/// Sends messages as fast as `office` takes them. When it takes none, tries again after `rest`.
pub fn send(task: &mut Task, office: &PostOffice, to: Address, from: Address, rest: Ticks) -> Never {
    let mut number = 0u8;
    loop {
        if let Ok(message) = Message::new(to, from, &[number; MAX_PAYLOAD]) {
            match office.deliver(task, message, Source::Task) {
                Ok(()) => number = number.wrapping_add(1),
                Err(_) => task.delay(rest),
            }
        }
    }
}

/// Counts the messages that come to `mailbox`.
pub fn count(task: &mut Task, mailbox: &Mailbox, counts: Counts) -> Never {
    let mut number = 0u8;
    loop {
        mailbox.wait(task);
        while let Some(message) = mailbox.take(task) {
            let is_in_turn = message.payload() == [number; MAX_PAYLOAD];
            number = message.payload().first().map_or(0, |number| number.wrapping_add(1));
            let counted = if is_in_turn { counts.in_turn } else { counts.out_of_turn };
            task.mask(|masked| counted.set(masked, counted.get(masked).wrapping_add(1)));
        }
    }
}
