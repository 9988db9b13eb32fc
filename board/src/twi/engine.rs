//! The answers to each status of the two-wire serial interface, for packets between the MCUs of a module. The
//! engine touches no register and no buffer.
//!
//! Each MCU is both master transmitter and slave receiver; either may start.
//!
//! ```text
//!   outgoing:  Idle ── send ──► Waiting ── START ──► Sending ── STOP ──► Ended ── outcome ──► Idle
//!                                  ▲                    │
//!                                  └─ arbitration lost ─┘
//!
//!   incoming:  Free ── addressed ──► Filling ── STOP ──► Whole ── receive ──► Free
//!               ▲                       │
//!               └── too long, fault ────┘
//! ```
//!
//! A START is requested while the outgoing packet is `Waiting`, and the own address is acknowledged while the
//! incoming buffer is `Free`. Each answer carries both, so an event of one side loses neither of the other.

use tasks::device::Transfer;

use super::status;

/// The most bytes in a transfer, without the address.
pub const CAPACITY: usize = 24;

/// How many bytes of a packet can be stored into a free buffer and acknowledged without the engine.
pub const STORABLE: u8 = CAPACITY as u8 - 1;

/// The packet for the other MCU. Its first byte is SLA+W, the address.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
enum Outgoing {
    Idle,
    /// A START follows when the bus is free.
    Waiting {
        length: u8,
    },
    /// This MCU has the bus; `next` is the index of the next byte.
    Sending {
        next: u8,
        length: u8,
    },
    Ended(Transfer),
}

/// The packet from the other MCU.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
enum Incoming {
    Free,
    Filling { length: u8 },
    Whole { length: u8 },
}

/// The use of TWDR.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Data {
    None,
    /// Send the byte of this index.
    Send(u8),
    /// Send ones.
    Ones,
    /// Store the received byte at this index.
    Store(u8),
}

/// The answer to a status, besides what [`Engine::wants_start`] and [`Engine::acknowledges`] return.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Answer {
    pub data: Data,
    /// Whether to end the transfer by a STOP, or to release the bus after a fault.
    pub stops: bool,
    /// Whether a packet has ended or become whole, so that the task is to be woken.
    pub signals: bool,
}

impl Answer {
    const GO_ON: Answer = Answer { data: Data::None, stops: false, signals: false };

    const fn data(data: Data) -> Answer {
        Answer { data, ..Answer::GO_ON }
    }
}

/// The state of both packets.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Engine {
    outgoing: Outgoing,
    incoming: Incoming,
}

impl Engine {
    /// Nothing to send, and nothing received.
    pub const fn new() -> Engine {
        Engine { outgoing: Outgoing::Idle, incoming: Incoming::Free }
    }

    /// Whether the interface should send a START when the bus is free (TWSTA).
    pub fn wants_start(&self) -> bool {
        matches!(self.outgoing, Outgoing::Waiting { .. })
    }

    /// Whether a packet has the bus.
    pub fn is_sending(&self) -> bool {
        matches!(self.outgoing, Outgoing::Sending { .. })
    }

    /// Whether the interface should acknowledge its address or the next byte (TWEA).
    pub fn acknowledges(&self) -> bool {
        match self.incoming {
            Incoming::Free => true,
            Incoming::Filling { length } => usize::from(length) < CAPACITY,
            Incoming::Whole { .. } => false,
        }
    }

    /// The answer to `status`, TWSR without its prescaler bits.
    pub fn answer(&mut self, status: u8) -> Answer {
        match status {
            status::START | status::REPEATED_START => self.begin(),
            status::ADDRESS_ACKNOWLEDGED | status::DATA_ACKNOWLEDGED => self.send_next(),
            status::ADDRESS_REFUSED | status::DATA_REFUSED => self.end(Transfer::Refused),
            status::ARBITRATION_LOST | status::LOST_AND_CALLED => self.try_again(Data::None),
            status::LOST_AND_READ => self.try_again(Data::Ones),
            status::LOST_AND_ADDRESSED => {
                self.try_again(Data::None);
                self.fill()
            }
            status::ADDRESSED => self.fill(),
            status::RECEIVED => self.store(),
            status::RECEIVED_REFUSED => self.drop_incoming(),
            status::STOP => self.complete(),
            status::READ | status::READ_ACKNOWLEDGED => Answer::data(Data::Ones),
            status::READ_REFUSED
            | status::READ_LAST
            | status::CALLED
            | status::CALL_RECEIVED
            | status::CALL_RECEIVED_REFUSED => Answer::GO_ON,
            // A bus error, or a status of the master receiver, which no packet needs.
            _ => self.fault(),
        }
    }

    fn begin(&mut self) -> Answer {
        match self.outgoing {
            Outgoing::Waiting { length } => {
                self.outgoing = Outgoing::Sending { next: 1, length };
                Answer::data(Data::Send(0))
            }
            _ => self.fault(),
        }
    }

    fn send_next(&mut self) -> Answer {
        match self.outgoing {
            Outgoing::Sending { next, length } if next < length => {
                self.outgoing = Outgoing::Sending { next: next + 1, length };
                Answer::data(Data::Send(next))
            }
            _ => self.end(Transfer::Done),
        }
    }

    /// Ends the transfer that has the bus.
    fn end(&mut self, outcome: Transfer) -> Answer {
        match self.outgoing {
            Outgoing::Sending { .. } => {
                self.outgoing = Outgoing::Ended(outcome);
                Answer { stops: true, signals: true, ..Answer::GO_ON }
            }
            _ => self.fault(),
        }
    }

    fn try_again(&mut self, data: Data) -> Answer {
        if let Outgoing::Sending { length, .. } = self.outgoing {
            self.outgoing = Outgoing::Waiting { length };
        }
        Answer::data(data)
    }

    fn fill(&mut self) -> Answer {
        if !matches!(self.incoming, Incoming::Whole { .. }) {
            self.incoming = Incoming::Filling { length: 0 };
        }
        Answer::GO_ON
    }

    fn store(&mut self) -> Answer {
        // The address came while the last packet was still there, but that was taken before the first byte
        // came: so the byte is acknowledged.
        if self.incoming == Incoming::Free {
            self.incoming = Incoming::Filling { length: 0 };
        }
        match self.incoming {
            Incoming::Filling { length } if usize::from(length) < CAPACITY => {
                self.incoming = Incoming::Filling { length: length + 1 };
                Answer::data(Data::Store(length))
            }
            _ => Answer::GO_ON,
        }
    }

    fn drop_incoming(&mut self) -> Answer {
        if let Incoming::Filling { .. } = self.incoming {
            self.incoming = Incoming::Free;
        }
        Answer::GO_ON
    }

    /// Completes the incoming packet. A packet without bytes is none: the other side only checked whether
    /// this MCU is there.
    fn complete(&mut self) -> Answer {
        match self.incoming {
            Incoming::Filling { length } if length > 0 => {
                self.incoming = Incoming::Whole { length };
                Answer { signals: true, ..Answer::GO_ON }
            }
            _ => self.drop_incoming(),
        }
    }

    /// Gives up what is under way, on both sides, and releases the bus.
    fn fault(&mut self) -> Answer {
        self.drop_incoming();
        let is_under_way = matches!(self.outgoing, Outgoing::Waiting { .. } | Outgoing::Sending { .. });
        if is_under_way {
            self.outgoing = Outgoing::Ended(Transfer::Fault);
        }
        Answer { stops: true, signals: is_under_way, ..Answer::GO_ON }
    }

    /// Records what went over the bus without an [`answer`](Self::answer): `sent` bytes of the outgoing
    /// packet are sent, and `received` bytes of the incoming one are stored.
    #[inline(always)]
    pub fn catch_up(&mut self, sent: u8, received: u8) {
        match self.outgoing {
            Outgoing::Waiting { length } | Outgoing::Sending { length, .. } => {
                self.outgoing = match sent {
                    0 => Outgoing::Waiting { length }, // or the other MCU came first
                    sent => Outgoing::Sending { next: sent.min(length), length },
                };
            }
            _ => {}
        }
        match self.incoming {
            Incoming::Free | Incoming::Filling { .. } if received > 0 => {
                self.incoming = Incoming::Filling { length: received };
            }
            _ => {}
        }
    }

    /// Records the end of packets that were answered without the engine: of the outgoing one, and its
    /// outcome, and of the incoming one.
    pub fn settle(&mut self, sent: Option<Transfer>, is_received: bool) {
        if let Some(outcome) = sent {
            self.end(outcome);
        }
        if is_received {
            self.complete();
        }
    }

    /// The bytes that can be sent without the engine, from a START on, as long as they are acknowledged: the
    /// index of the first, and their number.
    #[inline(always)]
    pub fn sendable(&self) -> (u8, u8) {
        match self.outgoing {
            Outgoing::Waiting { length } => (0, length),
            Outgoing::Sending { next, length } => (next, length.saturating_sub(next)),
            _ => (0, 0),
        }
    }

    /// The bytes that can be stored and acknowledged without the engine, from the own address on: the index
    /// of the first, and their number. The last one that fits is not among them, since it is not
    /// acknowledged.
    #[inline(always)]
    pub fn storable(&self) -> (u8, u8) {
        match self.incoming {
            Incoming::Free => (0, STORABLE),
            Incoming::Filling { length } => (length, STORABLE.saturating_sub(length)),
            Incoming::Whole { .. } => (0, 0),
        }
    }

    /// Forgets what is under way on the bus, which was freed. A complete incoming packet stays, and so does
    /// the outcome of a packet that has ended: otherwise that packet would cross twice.
    pub fn reset(&mut self) {
        if !matches!(self.outgoing, Outgoing::Ended(_)) {
            self.outgoing = Outgoing::Idle;
        }
        self.drop_incoming();
    }

    /// Whether no packet is under way, and the outcome of the last was taken.
    pub fn is_idle(&self) -> bool {
        self.outgoing == Outgoing::Idle
    }

    /// Begins to send a packet of `length` bytes, the address among them, if [`is_idle`](Self::is_idle).
    pub fn send(&mut self, length: u8) {
        if self.is_idle() {
            self.outgoing = Outgoing::Waiting { length };
        }
    }

    /// The outcome of the transfer that has ended. It is returned once.
    pub fn outcome(&mut self) -> Option<Transfer> {
        let Outgoing::Ended(outcome) = self.outgoing else { return None };
        self.outgoing = Outgoing::Idle;
        Some(outcome)
    }

    /// The length of a complete incoming packet, until it is released.
    pub fn received(&self) -> Option<u8> {
        match self.incoming {
            Incoming::Whole { length } => Some(length),
            _ => None,
        }
    }

    /// Makes room for the next packet.
    pub fn release(&mut self) {
        if let Incoming::Whole { .. } = self.incoming {
            self.incoming = Incoming::Free;
        }
    }
}

impl Default for Engine {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests;
