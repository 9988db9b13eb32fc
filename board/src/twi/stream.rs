//! The bytes of a packet that the vector handles without the engine, from its START to the last one.
//!
//! Between two bytes the interface holds SCL low until it is answered, so each answer lengthens the transfer:
//! at 400 kHz a byte takes 360 cycles on the wire. An interrupt of the kernel and the [engine](super::engine)
//! would add 250 to each; the vector, which answers by this and [does not enter the kernel](crate::deferred),
//! adds 50. At the end of a packet it lets the [software interrupt](crate::deferred) answer; the effect on
//! the engine is [settled](Ended) by the next code that asks the engine. The engine answers everything else.

use core::cell::Cell;

use tasks::device::Transfer;

use super::control::{ACKNOWLEDGE, ENABLED, GO_ON, INTERRUPT, START, STOP};
use super::engine::{Data, Engine};
use super::status;

/// The progress of both packets, as far as the vector may go by itself.
pub struct Streams {
    /// The index of the byte to send next, and the one behind the last. They are equal if nothing is to be
    /// sent.
    next: Cell<u8>,
    end: Cell<u8>,
    /// The index at which the next received byte is stored, and the end of those that can be stored and
    /// acknowledged. They are equal if none can.
    stored: Cell<u8>,
    storable: Cell<u8>,
    /// What has ended since the engine was last told.
    ended: Cell<Ended>,
}

/// What has ended without the engine.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Ended {
    /// The outcome of the outgoing packet.
    pub sent: Option<Transfer>,
    /// Whether the incoming packet has ended, with at least one byte.
    pub is_received: bool,
}

impl Ended {
    const NOTHING: Ended = Ended { sent: None, is_received: false };
}

impl Streams {
    /// Nothing may be sent or stored.
    pub const fn new() -> Streams {
        Streams {
            next: Cell::new(0),
            end: Cell::new(0),
            stored: Cell::new(0),
            storable: Cell::new(0),
            ended: Cell::new(Ended::NOTHING),
        }
    }

    /// What to do with TWDR if TWSR is `twsr` and the answer is to continue and to acknowledge. `None`: the
    /// engine must be asked.
    ///
    /// This changes nothing: call [`advance`](Self::advance) for that, once the bus goes on.
    #[inline(always)]
    pub fn answer(&self, twsr: u8) -> Option<Data> {
        // The statuses that come with each byte are checked first. The prescaler's bits are 0 here: if they
        // were not, the engine would answer.
        match twsr {
            status::DATA_ACKNOWLEDGED => return self.send_next(),
            status::RECEIVED => {
                let stored = self.stored.get();
                return (stored < self.storable.get()).then_some(Data::Store(stored));
            }
            _ => {}
        }
        match twsr & status::MASK {
            status::START | status::ADDRESS_ACKNOWLEDGED => self.send_next(),
            status::ADDRESSED if self.is_free() => Some(Data::None),
            _ => None,
        }
    }

    #[inline(always)]
    fn send_next(&self) -> Option<Data> {
        let next = self.next.get();
        (next < self.end.get()).then_some(Data::Send(next))
    }

    /// What to write to TWCR if a packet has ended as it should, its address was refused, or it gives way to
    /// the other MCU's packet. `None`: the engine must be asked.
    #[inline(always)]
    pub fn turn(&self, status: u8) -> Option<u8> {
        let ended = self.ended.get();
        match status {
            // The packet restarts after the other one.
            status::LOST_AND_ADDRESSED if self.is_free() => {
                self.next.set(0);
                return Some(GO_ON);
            }
            status::DATA_ACKNOWLEDGED | status::ADDRESS_ACKNOWLEDGED => {
                self.ended.set(Ended { sent: Some(Transfer::Done), ..ended });
            }
            status::ADDRESS_REFUSED => self.ended.set(Ended { sent: Some(Transfer::Refused), ..ended }),
            status::STOP if self.stored.get() > 0 => {
                self.ended.set(Ended { is_received: true, ..ended });
                self.storable.set(self.stored.get());
                let start = if self.send_next().is_some() { START } else { 0 };
                return Some(ENABLED | INTERRUPT | start);
            }
            _ => return None,
        }
        self.end.set(self.next.get());
        let acknowledge = if self.is_free() { ACKNOWLEDGE } else { 0 };
        Some(ENABLED | INTERRUPT | STOP | acknowledge)
    }

    /// Whether anything has ended since [`take_ended`](Self::take_ended) was last called.
    #[inline(always)]
    pub fn has_ended(&self) -> bool {
        self.ended.get() != Ended::NOTHING
    }

    /// Ends the incoming packet if any of it has come: the bus was freed, so its STOP may have been missed.
    /// The reader of the packet checks whether it is whole.
    #[inline(always)]
    pub fn end_incoming(&self) {
        if self.stored.get() > 0 {
            self.ended.set(Ended { is_received: true, ..self.ended.get() });
        }
    }

    /// What has ended since this was last called.
    #[inline(always)]
    pub fn take_ended(&self) -> Option<Ended> {
        let ended = self.ended.replace(Ended::NOTHING);
        (ended != Ended::NOTHING).then_some(ended)
    }

    /// Whether the buffer is empty for an incoming packet.
    #[inline(always)]
    fn is_free(&self) -> bool {
        self.stored.get() == 0 && self.storable.get() != 0
    }

    /// Records that `data` was the answer.
    #[inline(always)]
    pub fn advance(&self, data: Data) {
        match data {
            Data::Send(index) => self.next.set(index + 1),
            Data::Store(index) => self.stored.set(index + 1),
            Data::None | Data::Ones => {}
        }
    }

    /// Allows the vector what `engine` allows.
    #[inline(always)]
    pub fn arm(&self, engine: &Engine) {
        self.arm_outgoing(engine);
        self.arm_incoming(engine);
    }

    /// The same for the outgoing packet.
    #[inline(always)]
    pub fn arm_outgoing(&self, engine: &Engine) {
        let (next, number) = engine.sendable();
        self.next.set(next);
        self.end.set(next + number);
    }

    /// The same for the incoming packet.
    #[inline(always)]
    pub fn arm_incoming(&self, engine: &Engine) {
        let (stored, number) = engine.storable();
        self.stored.set(stored);
        self.storable.set(stored + number);
    }

    /// Tells `engine` of the bytes that were sent and stored without it.
    #[inline(always)]
    pub fn catch_up(&self, engine: &mut Engine) {
        engine.catch_up(self.next.get(), self.stored.get());
    }
}

impl Default for Streams {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests;
