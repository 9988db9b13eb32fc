//! Stop-and-wait ARQ: a message is repeated until its acknowledgement comes, and the next one waits.
//!
//! There is no clock here: the caller that drives a [`Sender`] says when its time is up. Messages arrive
//! exactly once and in order, or the sender is told that it gave up; a message that was given up has arrived
//! once or not at all. The line has to keep frames in order.
//!
//! Four faults seen in such protocols, and what rules them out here:
//!
//! - *A duplicate is dropped in silence, so that one lost ACK ends in a give-up.* A receiver says
//!   "duplicate", and duplicates are acknowledged like new messages.
//! - *After a give-up or a reset the next message looks like a duplicate.* A receiver takes any
//!   [`Label`] but the last one for a new message. Giving up begins a new epoch; a reset begins with
//!   [`Turn::First`]; a receiver that was reset remembers no label.
//! - *A CRC that lets errors through.* See [`super::crc`].
//! - *An ACK forged by noise or by one's own reflection.* An ACK has a CRC and repeats the label of the frame
//!   it acknowledges, the sender's dock included. So an end's own ACK that is reflected bears the neighbour's
//!   label. An end never acknowledges a data frame that bears its own signature.
//!
//! What can still go wrong by chance:
//!
//! - A neighbour attached by the dock of the same number may bear the same epoch as this end (1 in 128) and
//!   is then taken for a reflection. If nothing is outstanding here, that begins a new epoch, and the second
//!   repetition gets through. If both ends have a message outstanding, one or both are told that it was given
//!   up, and then the epochs differ. Nothing is lost in silence.
//! - A sender that is reset before its first ACK, and then begins with an epoch that it had, sends
//!   what looks like a duplicate (1 in 256). So does one that gave up 256 messages in a row of which
//!   none arrived. Both end when the receiver is made anew, which it should be when its neighbour
//!   falls silent.

use super::frame::{Label, Turn};
use super::signature::{Signature, Signer};

/// The consequence of a time-out.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
#[must_use]
pub enum Timeout {
    /// Send the same frame once more.
    Retransmit,
    /// The last repetition was in vain: the message has failed.
    GaveUp,
}

/// The sending half: at most one message is outstanding.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub struct Sender {
    signer: Signer,
    turn: Turn,
    /// Repetitions left for the outstanding message.
    retries_left: Option<u8>,
    retry_limit: u8,
}

impl Sender {
    /// A message is repeated up to `retry_limit` times before it is given up.
    pub const fn new(signer: Signer, retry_limit: u8) -> Sender {
        Sender { signer, turn: Turn::First, retries_left: None, retry_limit }
    }

    /// Takes up a new message, to be sent with this label. A message still outstanding is abandoned, for
    /// example a hormone that a newer one supersedes.
    pub fn start(&mut self) -> Label {
        if self.is_busy() {
            self.abandon();
        }
        self.retries_left = Some(self.retry_limit);
        self.label()
    }

    /// Whether a message is outstanding.
    pub fn is_busy(&self) -> bool {
        self.retries_left.is_some()
    }

    /// Takes in an ACK. True if it is that of the outstanding message, which thereby is delivered.
    #[must_use]
    pub fn on_ack(&mut self, label: Label) -> bool {
        let delivered = self.is_busy() && label == self.label();
        if delivered {
            self.retries_left = None;
            self.turn = self.turn.next();
        }
        delivered
    }

    /// The ACK did not come in time. `None` if nothing is outstanding: the ACK came at the last moment.
    pub fn on_timeout(&mut self) -> Option<Timeout> {
        match self.retries_left? {
            0 => {
                self.abandon();
                Some(Timeout::GaveUp)
            }
            retries => {
                self.retries_left = Some(retries - 1);
                Some(Timeout::Retransmit)
            }
        }
    }

    /// Drops the outstanding message. Whether it arrived stays unknown, therefore a new epoch
    /// begins.
    pub fn abandon(&mut self) {
        self.retries_left = None;
        self.signer.renew();
    }

    /// Whether a data frame with this signature is a reflection of this end's own. See the module's text for
    /// why an idle sender then begins a new epoch.
    #[must_use]
    pub fn is_reflection(&mut self, signature: Signature) -> bool {
        let own = self.signer.recognises(signature);
        if own && !self.is_busy() {
            self.abandon();
        }
        own
    }

    fn label(&self) -> Label {
        Label { signature: self.signer.signature(), turn: self.turn }
    }
}

/// The receiving half: remembers the last message taken.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub struct Receiver {
    last: Option<Label>,
}

impl Receiver {
    pub const fn new() -> Receiver {
        Receiver { last: None }
    }

    /// Whether the message with this label was taken already. Then it is only acknowledged again.
    pub fn is_duplicate(&self, label: Label) -> bool {
        self.last == Some(label)
    }

    /// The message with this label was taken. Only now may it be acknowledged. A message that found no buffer
    /// is neither accepted nor acknowledged, and the neighbour repeats it.
    pub fn accept(&mut self, label: Label) {
        self.last = Some(label);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dock::Dock;

    const SEED: u16 = 0x0240;

    fn sender() -> Sender {
        Sender::new(Signer::new(Dock::Back, SEED), 2)
    }

    /// Has a receiver take a message. Returns whether it delivers it; it acknowledges either way.
    fn delivers(receiver: &mut Receiver, label: Label) -> bool {
        let new = !receiver.is_duplicate(label);
        if new {
            receiver.accept(label);
        }
        new
    }

    #[test]
    fn a_message_is_repeated_up_to_the_limit_then_given_up() {
        let mut sender = sender();
        assert_eq!(sender.on_timeout(), None);
        sender.start();
        assert_eq!(sender.on_timeout(), Some(Timeout::Retransmit));
        assert_eq!(sender.on_timeout(), Some(Timeout::Retransmit));
        assert_eq!(sender.on_timeout(), Some(Timeout::GaveUp));
        assert!(!sender.is_busy());
        assert_eq!(sender.on_timeout(), None);
    }

    #[test]
    fn the_limit_counts_for_each_message_anew() {
        let mut sender = sender();
        for _ in 0..3 {
            let label = sender.start();
            assert_eq!(sender.on_timeout(), Some(Timeout::Retransmit));
            assert_eq!(sender.on_timeout(), Some(Timeout::Retransmit));
            assert!(sender.on_ack(label));
        }
    }

    #[test]
    fn fault_a_a_duplicate_is_acknowledged_again() {
        let (mut sender, mut receiver) = (sender(), Receiver::new());
        let label = sender.start();
        assert!(delivers(&mut receiver, label));
        // The ACK is lost; the repetition is not delivered, and its ACK ends the matter.
        assert_eq!(sender.on_timeout(), Some(Timeout::Retransmit));
        assert!(!delivers(&mut receiver, label));
        assert!(sender.on_ack(label));
    }

    #[test]
    fn fault_b_after_a_give_up_the_next_message_is_no_duplicate() {
        let (mut sender, mut receiver) = (sender(), Receiver::new());
        for _ in 0..300 {
            // Delivered, but every ACK is lost.
            let label = sender.start();
            assert!(delivers(&mut receiver, label));
            while sender.on_timeout() != Some(Timeout::GaveUp) {
                assert!(!delivers(&mut receiver, label));
            }
        }
    }

    #[test]
    fn fault_b_after_a_reset_of_the_sender_the_next_message_is_no_duplicate() {
        let mut receiver = Receiver::new();
        for boot in 0..300 {
            let mut sender = Sender::new(Signer::new(Dock::Back, SEED + boot), 2);
            for _ in 0..boot % 4 {
                let label = sender.start();
                assert!(delivers(&mut receiver, label));
                assert!(sender.on_ack(label));
            }
        }
    }

    #[test]
    fn fault_b_a_reset_with_the_same_seed_is_seen_from_the_second_message_on() {
        for sent in 2..6 {
            let mut receiver = Receiver::new();
            let mut sender = sender();
            for _ in 0..sent {
                let label = sender.start();
                assert!(delivers(&mut receiver, label));
                assert!(sender.on_ack(label));
            }
            let label = self::sender().start();
            assert!(delivers(&mut receiver, label), "after {sent} messages");
        }
    }

    #[test]
    fn fault_b_after_a_reset_of_the_receiver_the_next_message_is_delivered() {
        let mut sender = sender();
        for _ in 0..5 {
            let mut receiver = Receiver::new();
            let label = sender.start();
            assert!(delivers(&mut receiver, label));
            assert!(sender.on_ack(label));
        }
    }

    #[test]
    fn fault_d_only_the_ack_of_the_outstanding_message_counts() {
        let mut sender = sender();
        let label = sender.start();
        for dock in Dock::ALL {
            for epoch in 0..=255 {
                for turn in [Turn::Even, Turn::Odd, Turn::First] {
                    let ack = Label { signature: Signature { dock, epoch }, turn };
                    assert_eq!(sender.clone().on_ack(ack), ack == label);
                }
            }
        }
    }

    #[test]
    fn fault_d_an_ack_counts_once_and_not_for_a_later_message() {
        let mut sender = sender();
        let label = sender.start();
        assert!(sender.on_ack(label));
        assert!(!sender.on_ack(label));
        sender.start();
        assert!(!sender.on_ack(label));
        sender.start();
        assert!(!sender.on_ack(label));
    }

    #[test]
    fn a_newer_message_supersedes_the_outstanding_one() {
        let (mut sender, mut receiver) = (sender(), Receiver::new());
        let older = sender.start();
        assert!(delivers(&mut receiver, older));
        let newer = sender.start();
        assert!(!sender.on_ack(older));
        assert!(delivers(&mut receiver, newer));
        assert!(sender.on_ack(newer));
    }
}
