//! The receiving half of a dock's link: it deals with the frames that come in.

use kernel::Ticks;

use super::counters::Counted;
use super::endpoint::Arrival;
use super::frame::{Frame, Label};
use super::sender::Shared;
use crate::dock::Dock;
use crate::message::{Address, Message, TaskCode};
use crate::post_office::Undelivered;

/// After a silence of this many ticks of 1 ms the neighbour may be another module than before, whose first
/// message is no repetition whatever its label. A neighbour that is there probes every 40 ms. (The clock
/// wraps: a silence of up to this much more than a multiple of 65.5 s is not noticed. Then what
/// [`arq`](super::arq) says of equal epochs applies.)
pub const SILENCE: Ticks = 400;

/// What a receiver works on.
pub trait Arriving: Shared {
    /// Hands on a message from the neighbour.
    ///
    /// # Errors
    /// [`Undelivered`].
    fn deliver(&mut self, message: Message) -> Result<(), Undelivered>;

    /// Asks the sender for an ACK, and wakes it. A newer one takes the place of one not yet sent: the
    /// neighbour has one message outstanding at a time.
    fn acknowledge(&mut self, label: Label);

    /// Has the sender check whether its message has arrived.
    fn wake_sender(&mut self);

    /// Whether the dock's latch is open for sure, so that no other dock can hold on to it.
    fn is_open(&self) -> bool;
}

/// The receiving half of a dock's link.
pub struct Receiver {
    dock: Dock,
    /// When the last frame of the neighbour came.
    heard_at: Ticks,
}

impl Receiver {
    /// The receiver of `dock`, from `now` on.
    pub const fn new(dock: Dock, now: Ticks) -> Self {
        Receiver { dock, heard_at: now }
    }

    /// Handles a frame that came in at `now`.
    #[inline(always)] // a frame of its own would take stack
    pub fn receive(&mut self, now: Ticks, frame: Frame, dock: &mut impl Arriving) {
        dock.count(Counted::FramesReceived);
        let is_stranger = now.wrapping_sub(self.heard_at) > SILENCE;
        let arrival = dock.endpoint(|endpoint| {
            if is_stranger {
                endpoint.forget_neighbour();
            }
            endpoint.on_frame(frame)
        });
        // Infrared reaches farther than hooks. A probe that comes in at an open dock is of a module nearby
        // that is no neighbour. A message may come in there all the same, of a remote control.
        if matches!(arrival, Arrival::Datagram { .. }) && dock.is_open() {
            return dock.count(Counted::Ignored);
        }
        if !matches!(arrival, Arrival::Reflection) {
            self.heard_at = now;
        }
        match arrival {
            Arrival::Message { label, to, payload } => {
                // Acknowledged unless there is no room now: repetition does not help a message that no task
                // here takes.
                if self.deliver(to, payload, dock) {
                    dock.endpoint(|endpoint| endpoint.accept(label));
                    dock.acknowledge(label);
                }
            }
            Arrival::Duplicate(label) => {
                dock.count(Counted::Duplicates);
                dock.acknowledge(label);
            }
            Arrival::Datagram { to, payload } => {
                self.deliver(to, payload, dock);
            }
            Arrival::Delivered => dock.wake_sender(),
            Arrival::StaleAck => {}
            Arrival::Reflection => dock.count(Counted::Reflections),
        }
    }

    /// Hands a message on, and counts it if that fails. Returns whether it is dealt with.
    #[inline(always)] // a frame of its own would take 40 bytes more of the stack
    fn deliver(&self, to: TaskCode, payload: &[u8], dock: &mut impl Arriving) -> bool {
        let from = Address::beyond(self.dock, to);
        // A frame holds no more than a message.
        let Ok(message) = Message::new(Address::here(to), from, payload) else { return true };
        let Err(undelivered) = dock.deliver(message) else { return true };
        dock.count(match undelivered {
            Undelivered::Ignored => Counted::Ignored,
            Undelivered::Refused => Counted::Refused,
            Undelivered::NoRoom => Counted::NoBuffer,
        });
        undelivered != Undelivered::NoRoom
    }
}

#[cfg(test)]
mod tests;
