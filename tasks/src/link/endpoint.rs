//! One dock's end of a link: what becomes of each frame that comes in.

use super::arq::{Receiver, Sender};
use super::frame::{Frame, Label};
use super::signature::{Signature, Signer};
use crate::dock::Dock;
use crate::message::TaskCode;

/// The meaning of a frame that came in, and what is to be done.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
#[must_use]
pub enum Arrival<'a> {
    /// A new message. Once it is taken, [`Endpoint::accept`] it and acknowledge it. If there is no
    /// room for it, do nothing: the neighbour repeats it.
    Message { label: Label, to: TaskCode, payload: &'a [u8] },
    /// A message taken before, whose ACK was lost: acknowledge it again.
    Duplicate(Label),
    /// A message that is not acknowledged.
    Datagram { to: TaskCode, payload: &'a [u8] },
    /// The outstanding message has arrived: the next one may start.
    Delivered,
    /// An ACK for nothing that is outstanding: it came late, or twice.
    StaleAck,
    /// A frame of this dock's own that was reflected.
    Reflection,
}

/// Both halves of the ARQ at one dock, and the signature of its datagrams.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub struct Endpoint {
    pub sender: Sender,
    receiver: Receiver,
    /// Separate from the sender's signer, because this one changes with each datagram. Probes go out all the
    /// time, so a neighbour that bears the same signature by chance is unheard for one probe only.
    datagrams: Signer,
}

impl Endpoint {
    /// The end at `dock`. `seed` should differ from dock to dock, from module to module, and after each
    /// reset; it is best counted on in memory that a reset leaves alone. A message is repeated up to
    /// `retry_limit` times.
    pub const fn new(dock: Dock, seed: u16, retry_limit: u8) -> Endpoint {
        let signer = Signer::new(dock, seed);
        Endpoint { sender: Sender::new(signer, retry_limit), receiver: Receiver::new(), datagrams: signer }
    }

    /// The signature for the next datagram.
    pub fn sign_datagram(&mut self) -> Signature {
        self.datagrams.renew();
        self.datagrams.signature()
    }

    /// The meaning of a frame that came in at this dock.
    pub fn on_frame<'a>(&mut self, frame: Frame<'a>) -> Arrival<'a> {
        match frame {
            Frame::Data { label, to, payload } => {
                if self.sender.is_reflection(label.signature) {
                    Arrival::Reflection
                } else if self.receiver.is_duplicate(label) {
                    Arrival::Duplicate(label)
                } else {
                    Arrival::Message { label, to, payload }
                }
            }
            Frame::Datagram { signature, to, payload } => {
                if self.datagrams.recognises(signature) {
                    Arrival::Reflection
                } else {
                    Arrival::Datagram { to, payload }
                }
            }
            // An ACK for the message taken last is this end's own.
            Frame::Ack(label) if self.receiver.is_duplicate(label) => Arrival::Reflection,
            Frame::Ack(label) if self.sender.on_ack(label) => Arrival::Delivered,
            Frame::Ack(_) => Arrival::StaleAck,
        }
    }

    /// The message with this label was taken.
    pub fn accept(&mut self, label: Label) {
        self.receiver.accept(label);
    }

    /// The neighbour has left or fallen silent: the next frame is from a stranger.
    pub fn forget_neighbour(&mut self) {
        self.receiver = Receiver::new();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TO: TaskCode = TaskCode::HORMONE;
    const PAYLOAD: &[u8] = &[1, 2];

    fn data(endpoint: &mut Endpoint) -> Frame<'static> {
        Frame::Data { label: endpoint.sender.start(), to: TO, payload: PAYLOAD }
    }

    fn datagram(endpoint: &mut Endpoint) -> Frame<'static> {
        Frame::Datagram { signature: endpoint.sign_datagram(), to: TO, payload: PAYLOAD }
    }

    /// Has `endpoint` take a message; returns what to acknowledge.
    fn take(endpoint: &mut Endpoint, frame: Frame) -> Label {
        match endpoint.on_frame(frame) {
            Arrival::Message { label, to: TO, payload: PAYLOAD } => {
                endpoint.accept(label);
                label
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_message_is_taken_acknowledged_and_acknowledged_again() {
        let mut back = Endpoint::new(Dock::Back, 0x0203, 3);
        let mut front = Endpoint::new(Dock::Front, 0x0405, 3);
        for _ in 0..3 {
            let frame = data(&mut back);
            let label = take(&mut front, frame);
            assert_eq!(front.on_frame(frame), Arrival::Duplicate(label));
            assert_eq!(back.on_frame(Frame::Ack(label)), Arrival::Delivered);
            assert_eq!(back.on_frame(Frame::Ack(label)), Arrival::StaleAck);
        }
    }

    #[test]
    fn a_message_that_finds_no_room_is_new_when_it_is_repeated() {
        let mut back = Endpoint::new(Dock::Back, 0x0203, 3);
        let mut front = Endpoint::new(Dock::Front, 0x0405, 3);
        let frame = data(&mut back);
        assert!(matches!(front.on_frame(frame), Arrival::Message { .. }));
        take(&mut front, frame);
    }

    #[test]
    fn fault_d_own_frames_that_come_back_are_dropped() {
        let mut back = Endpoint::new(Dock::Back, 0x0203, 3);
        let mut front = Endpoint::new(Dock::Front, 0x0203, 3);
        let frame = data(&mut back);
        assert_eq!(back.on_frame(frame), Arrival::Reflection);
        assert!(back.sender.is_busy(), "a reflection is no acknowledgement");
        let probe = datagram(&mut back);
        assert_eq!(back.on_frame(probe), Arrival::Reflection);
        // The neighbour's outstanding message has the same epoch and turn as the one it acknowledges: its own
        // ACK, come back, must not acknowledge it.
        data(&mut front);
        let ack = Frame::Ack(take(&mut front, frame));
        assert_eq!(front.on_frame(ack), Arrival::Reflection);
        assert!(front.sender.is_busy());
        assert_eq!(back.on_frame(ack), Arrival::Delivered);
    }

    /// As above on docks of the same number, where the epochs come to be equal because a message is
    /// superseded.
    #[test]
    fn fault_d_an_own_ack_that_comes_back_late_acknowledges_nothing() {
        let mut here = Endpoint::new(Dock::Left, 0x0203, 3);
        let mut there = Endpoint::new(Dock::Left, 0x0406, 3);
        let theirs = data(&mut there);
        data(&mut here);
        let ack = Frame::Ack(take(&mut here, theirs));
        let Frame::Data { label, .. } = data(&mut here) else { unreachable!() };
        assert_eq!(Frame::Ack(label), ack, "superseding brings about the neighbour's epoch");
        assert_eq!(here.on_frame(ack), Arrival::Reflection);
        assert!(here.sender.is_busy());
    }

    #[test]
    fn fault_d_a_frame_superseded_while_it_comes_back_is_still_ones_own() {
        let mut back = Endpoint::new(Dock::Back, 0x0203, 3);
        let (older, older_probe) = (data(&mut back), datagram(&mut back));
        let (newer, newer_probe) = (data(&mut back), datagram(&mut back));
        for frame in [older, newer, older_probe, newer_probe] {
            assert_eq!(back.on_frame(frame), Arrival::Reflection);
        }
    }

    #[test]
    fn a_neighbour_on_the_same_dock_with_the_same_epoch_is_understood_at_its_second_repetition() {
        let mut here = Endpoint::new(Dock::Left, 0x0203, 3);
        let mut there = Endpoint::new(Dock::Left, 0x0403, 3);
        let frame = data(&mut there);
        assert_eq!(here.on_frame(frame), Arrival::Reflection);
        assert_eq!(here.on_frame(frame), Arrival::Reflection);
        let ack = Frame::Ack(take(&mut here, frame));
        assert_eq!(there.on_frame(ack), Arrival::Delivered);
    }

    #[test]
    fn probes_of_a_neighbour_on_the_same_dock_are_missed_for_a_moment_only() {
        let mut here = Endpoint::new(Dock::Left, 0x0203, 3);
        let mut there = Endpoint::new(Dock::Left, 0x0403, 3);
        let missed = (0..256)
            .filter(|_| {
                datagram(&mut here);
                let probe = datagram(&mut there);
                here.on_frame(probe) == Arrival::Reflection
            })
            .count();
        assert!(missed <= 2 * 2, "{missed} of 256");
    }

    #[test]
    fn a_new_neighbour_that_begins_like_the_old_one_is_no_duplicate() {
        let mut back = Endpoint::new(Dock::Back, 0x0203, 3);
        let frame = data(&mut Endpoint::new(Dock::Front, 0x0405, 3));
        take(&mut back, frame);
        back.forget_neighbour();
        take(&mut back, frame);
    }
}
