//! The interface of the system tasks to their devices. The board implements it.

use kernel::{Semaphore, Task};

use crate::dock::Dock;
use crate::docking::latch::{End, EndSwitches};
use crate::motor::joint::Reading;
use crate::sensor::Sensor;
use crate::superbot::Half;

/// The sending half of a dock's serial link.
pub trait Transmit {
    /// Whether a frame is coming in. The line is half duplex, so sending now would drown it.
    fn is_busy(&self, task: &mut Task) -> bool;

    /// Sends `bytes`, and blocks until the last stop bit is on the wire. Characters that come in meanwhile
    /// may be lost, so it may first wait for the end of one that is coming in.
    fn transmit(&mut self, task: &mut Task, bytes: &[u8]);
}

/// The receiving half of a dock's serial link.
pub trait Receive {
    /// From now on posts `signal` when there is something to [`receive`](Self::receive).
    fn listen(&mut self, task: &mut Task, signal: &'static Semaphore);

    /// Copies what has come to `buffer`. Once that is a whole frame, up to the zero byte that ends it,
    /// returns its length in bytes, zero included; until then the same buffer has to be given again.
    ///
    /// A frame whose end was lost ends when the next one begins.
    ///
    /// A frame that does not fit is dropped up to its zero, and counted in
    /// [`overruns`](Self::overruns), as are bytes that the hardware or the FIFO lost.
    fn receive(&mut self, task: &mut Task, buffer: &mut [u8]) -> Option<usize>;

    /// How many bytes and frames were lost on the way in. Stays at 65,535.
    fn overruns(&self, task: &mut Task) -> u16;
}

/// The latches of an MCU's docks, for the links.
pub trait Latches {
    /// Whether `dock` is [open](crate::docking::latch::EndSwitches::is_open).
    fn is_open(dock: Dock) -> bool;
}

/// Links at docks that have no latches.
pub struct NoLatches;

impl Latches for NoLatches {
    fn is_open(_: Dock) -> bool {
        false
    }
}

/// How a transfer over the bus between the MCUs ended.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Transfer {
    /// The other MCU acknowledged every byte.
    Done,
    /// The other MCU did not acknowledge its address or a byte: it is off, in reset or its buffer is full.
    Refused,
    /// The bus was in a state that the protocol does not know.
    Fault,
}

/// The bus between the two MCUs of a module. Either may start a transfer; after a lost arbitration the
/// transfer is tried again when the bus is free, without the task.
///
/// After a transfer has ended, or one from the other MCU has come in whole, the board posts the
/// semaphore that it was given for this.
pub trait Bus {
    /// Starts to send `bytes`, at most 24. One transfer at a time: the one before must have an outcome.
    fn send(&mut self, task: &mut Task, bytes: &[u8]);

    /// Starts to send once more what was sent last.
    fn send_again(&mut self, task: &mut Task);

    /// Frees the bus after a transfer has taken too long: a device may hold the bus, or this side may take it
    /// for busy when it is not. The transfer has no outcome, unless it ended before that after all. What has
    /// come from the other MCU by then counts as whole: its end may have been missed. Takes a quarter of a
    /// millisecond.
    fn free(&mut self, task: &mut Task);

    /// The outcome of the transfer that was started last, once.
    fn outcome(&mut self, task: &mut Task) -> Option<Transfer>;

    /// Copies what came from the other MCU to the start of `buffer`, and returns its length, once.
    /// Until then further transfers from there are refused.
    fn receive(&mut self, task: &mut Task, buffer: &mut [u8]) -> Option<usize>;
}

/// The motors of an MCU's joints, and what is measured of them. Joints are named by their indices.
pub trait JointMotors {
    /// From now on, each millisecond: puts the drives into effect, begins to measure the joints, and posts
    /// `period`.
    fn begin(&mut self, task: &mut Task, period: &'static Semaphore);

    /// Ends the periods. The last drives are put into effect, and stay.
    fn end(&mut self, task: &mut Task);

    /// Measures the joints once, within 2 ms.
    fn look(&mut self, task: &mut Task);

    /// The last measurement: as a period begins, that of the period before.
    fn reading(&self, task: &mut Task, joint: usize) -> Reading;

    /// Sets the drive from the next period on: -[`FULL_DRIVE`](crate::motor::FULL_DRIVE) to `FULL_DRIVE`.
    fn drive(&mut self, task: &mut Task, joint: usize, drive: i16);

    /// All drives of the next period have been given.
    fn done(&mut self);
}

/// A quantity that can be measured on demand.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Quantity {
    Sensor(Sensor),
    /// How much of its own light a dock sees reflected, in counts of the converter, 0 to 1023.
    Proximity(Dock),
    /// The current of the docking motor that runs, in mA.
    LatchCurrent,
}

/// The devices of an MCU besides links, bus and joints.
pub trait Peripherals {
    /// The half of the module that they are in.
    const HALF: Half;

    /// Starts a measurement of `quantity`.
    fn look(&mut self, task: &mut Task, quantity: Quantity);

    /// The measured value, in the quantity's unit; `None` until the measurement is done, and for a quantity
    /// that this MCU does not have.
    fn seen(&mut self, task: &mut Task, quantity: Quantity) -> Option<i16>;

    /// The end switches of the latch at `dock`.
    fn end_switches(&mut self, dock: Dock) -> EndSwitches;

    /// Drives the latch at `dock`; `None` is off.
    fn drive_latch(&mut self, dock: Dock, to: Option<End>);

    /// Closes the power switch of `dock`, or opens it. Too much current through it opens it as well.
    fn set_power(&mut self, task: &mut Task, dock: Dock, is_on: bool);

    /// The docks whose switches too much current has opened since the last call: a bit for each place.
    fn take_tripped(&mut self, task: &mut Task) -> u8;

    /// Switches the light of all docks here on or off.
    fn set_emitters(&mut self, is_on: bool);

    /// Switches the charger on or off.
    fn set_charger(&mut self, is_on: bool);

    /// Whether no byte of the EEPROM is being written. Only then may one be read or written.
    fn is_memory_ready(&mut self, task: &mut Task) -> bool;

    /// The byte at `address` of the EEPROM.
    fn recall(&mut self, address: u16) -> u8;

    /// Begins to write a byte of the EEPROM.
    fn store(&mut self, task: &mut Task, address: u16, byte: u8);
}
