//! The robot's clock and wires, from the description of the module.

use hormone::hormone::{Data, Hormone};
use hormone::pace::Pace;
use tasks::bridge::sender::{PAUSE, RETRY_LIMIT};
use tasks::dock::Dock;
pub use tasks::superbot::CLOCK_HZ;
use tasks::superbot::{BAUD, I2C_HZ, MASTER, RESIDENCE, SLAVE};

/// Cycles of a millisecond.
pub const MILLISECOND: u64 = CLOCK_HZ as u64 / 1000;

/// The longest that a robot runs between two looks, in cycles: 250 ms.
pub(crate) const STEP: u64 = 250 * MILLISECOND;

/// For how long an MCU does nothing after a reset: by its fuses it waits for the supply and the crystal to
/// settle, 65 ms and 16,384 clocks (ATmega128 datasheet, "System Clock and Clock Options", "Crystal
/// Oscillator"). At power-up, from which a robot's time counts, that is over.
pub const START_UP: u64 = 65 * MILLISECOND + 16_384;

/// Bits of a character: start, eight of data, stop.
const CHARACTER_BITS: u64 = 10;

/// Cycles of a character on the wire. The USARTs divide the clock by a multiple of 16.
pub const CHARACTER: u64 = CHARACTER_BITS * 16 * ((CLOCK_HZ + 8 * BAUD) / (16 * BAUD)) as u64;

/// Bytes of a frame on the wire beside its payload: control, epoch, CRC-16, and the one byte that COBS adds,
/// delimiter included. One frame in 40 takes one byte more.
pub(crate) const FRAME_OVERHEAD: u64 = 5;

/// The least chance of an arrival that is reckoned with: modules could not wait for a smaller one.
const HARDLY_ANY: f64 = 0.1;

/// For how long a message is sent again to an MCU that does not answer, before it is given up.
pub(crate) const GIVEN_UP_AFTER: u64 = RETRY_LIMIT as u64 * PAUSE as u64 * MILLISECOND;

/// Cycles of a bit on the two-wire bus inside a module.
pub(crate) const I2C_BIT: u64 = (CLOCK_HZ / I2C_HZ) as u64;

/// Whether messages through a dock cross the two-wire bus on their way from or to a behaviour.
pub fn is_on_slave(dock: Dock) -> bool {
    RESIDENCE.slave.docks.contains(dock)
}

/// Whether a dock's port is made of pins and a timer. It hears nothing while it sends: the timer does both.
pub fn is_on_pins(dock: Dock) -> bool {
    [MASTER.timer3, SLAVE.timer3].contains(&dock)
}

/// How much later than on a board a character comes from one of these docks to the other, in cycles: a
/// character that is sent by pins is known only at its end, and one that is received by them begins with an
/// edge. Modules can run apart for the time of a character only if it is that late for each end on pins.
/// Where they [share one light](crate::Change::SharedLight) it is [later yet](SHARED_LIGHT_LATENESS).
pub fn lateness(one: Dock, other: Dock, shares_light: bool) -> u64 {
    let on_pins = [one, other].into_iter().filter(|dock| is_on_pins(*dock)).count() as u64;
    on_pins * CHARACTER + if shares_light { SHARED_LIGHT_LATENESS } else { 0 }
}

/// How much later a character comes where the docks of a link share one light, in cycles, and how far modules
/// run apart then: a receiver has to know of all that is sent before a character ends.
pub const SHARED_LIGHT_LATENESS: u64 = CHARACTER / 8;

/// The least time, in cycles, that a hormone can take from one module to the next between these docks: that
/// of its frame, and of a transfer in each module where it crosses the bus.
pub(crate) fn wire_limit(from: Dock, to: Dock) -> u64 {
    let payload = payload();
    let frame = (payload + FRAME_OVERHEAD) * CHARACTER_BITS * u64::from(CLOCK_HZ) / u64::from(BAUD);
    // The slave's address, length, two addresses and CRC-8 beside the payload; nine bits each, and START and
    // STOP.
    let transfer = (2 + 9 * (payload + 5)) * I2C_BIT;
    let transfers = [from, to].into_iter().filter(|dock| is_on_slave(*dock)).count();
    frame + transfers as u64 * transfer
}

/// How often a hormone's frame is sent, on average, until it and its ACK have arrived, where lines lose
/// frames and change bytes with these chances.
pub(crate) fn tries(loss: f64, noise: f64) -> f64 {
    let arrives = |bytes: u64| ((1.0 - loss) * (1.0 - noise).powi(bytes as i32)).max(HARDLY_ANY);
    1.0 / (arrives(payload() + FRAME_OVERHEAD) * arrives(FRAME_OVERHEAD))
}

/// Bytes of a beat's hormone.
fn payload() -> u64 {
    let pace = Pace { name: 1, data: Data::A, is_made_good: false, number: 0, rhythm: 0, lifetime: None };
    Hormone::Pace(pace).to_payload().as_slice().len() as u64
}
