//! How long things take, in cycles.

use hormone::time::until;
use tasks::docking::latch::PERIOD_MS;

use crate::hardware::{CHARACTER, FRAME_OVERHEAD, I2C_BIT, MILLISECOND};

/// A millisecond of a module's clock: the kernel's tick.
pub const TICK: u64 = MILLISECOND;

/// The clock of an MCU: ticks since its program runs.
#[derive(Clone, Copy)]
pub struct Clock {
    /// When it reads 0, in cycles of the simulation.
    pub started_at: u64,
}

impl Clock {
    /// What it reads at `cycle`.
    pub fn ticks(self, cycle: u64) -> u16 {
        (cycle.saturating_sub(self.started_at) / TICK) as u16
    }

    /// The beginning of the tick that holds `cycle`.
    pub fn tick(self, cycle: u64) -> u64 {
        cycle - cycle.saturating_sub(self.started_at) % TICK
    }

    /// The beginning of the tick at which it reads `ticks`, seen from `now`; that of the present one if
    /// `ticks` is past.
    pub fn cycle(self, ticks: u16, now: u64) -> u64 {
        self.tick(now) + u64::from(until(ticks, self.ticks(now))) * TICK
    }
}

/// What a module does reaches no other module sooner: the other one hears a frame at the end of its first
/// character.
pub const LOOKAHEAD: u64 = SEND + CHARACTER;

/// A frame with so many bytes of payload.
pub fn frame(payload: usize) -> u64 {
    (FRAME_OVERHEAD + payload as u64) * CHARACTER
}

/// An ACK.
pub const fn ack() -> u64 {
    FRAME_OVERHEAD * CHARACTER
}

/// The transfer of a message with so many bytes of payload over the two-wire bus: address, length, two
/// addresses and CRC-8 beside the payload; nine bits each, and START and STOP.
pub fn transfer(payload: usize) -> u64 {
    (2 + 9 * (5 + payload as u64)) * I2C_BIT
}

// What the programs take in simavr; tests/simavr holds both engines together. RECEIVE, SEND,
// CROSS_BEFORE, CROSS_AFTER, WAKE and ACT are means over the beats of a chain of three, by `./x sim chain
// --modules 3 --world none --trace FILE --trace-of 0.master,1.master,1.slave`: from the end of a frame at
// a dock to "ready" of HORMONE, from there to the hormone's arrow, and so on along its way to the next
// wire. NEXT is of the second module of `four-legs`, which passes a hormone on three times.

/// From a module's power, or from the end of a reset, to its first tick. Folding SRAM to a nonce takes most
/// of it.
pub const START: u64 = micros(3000);

/// From the end of a frame until its message is in the mailbox that it is for, and an ACK goes out.
pub const RECEIVE: u64 = micros(110);

/// From the end of an ACK until its message counts as delivered.
pub const RECEIVE_ACK: u64 = micros(100);

/// From the end of a frame that was sent until the sending task looks at the clock.
pub const SENT: u64 = micros(60);

/// From a mailbox's message to the first bit on the wire.
pub const SEND: u64 = micros(86);

/// The time of a transfer between the MCUs that is not spent on its bits: before it, together with what both
/// programs take between its bytes, and after.
pub const CROSS_BEFORE: u64 = micros(84);
pub const CROSS_AFTER: u64 = micros(91);

/// From a mailbox's message to HORMONE or AC_RECV until it acts on it.
pub const WAKE: u64 = micros(226);

/// From then until the first message that HORMONE sends is in a mailbox, and from one to the next, while
/// tasks of higher priority pass the first one on.
pub const ACT: u64 = micros(36);
pub const NEXT: u64 = micros(184);

/// From one probe of AC_SEND to the next, and to a message of AC_RECV.
pub const TELL: u64 = micros(100);

/// From the start of the master's program until HORMONE is told what was kept without power.
pub const RECALL: u64 = (PERIOD_MS as u64 + 1) * TICK;

/// From the request for a sensor's value until HORMONE has the answer.
pub const READ: u64 = micros(3700);

/// From an action that lets a dock approach another until both are attached: a search, and the latch.
pub const APPROACH: u64 = 890 * MILLISECOND;

/// From an action that releases a dock until nothing is attached there.
pub const RELEASE: u64 = 794 * MILLISECOND;

const fn micros(number: u64) -> u64 {
    number * MILLISECOND / 1000
}
