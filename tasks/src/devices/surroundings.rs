//! The surroundings of the devices' state machine: what it measures, moves and tells.

use crate::device::Quantity;
use crate::dock::Dock;
use crate::docking::latch::{End, EndSwitches};
use crate::message::TaskCode;
use crate::motor::joint::State;
use crate::motor::joints::Order;
use crate::request::{Payload, Report, Request};
use crate::superbot::Half;

use super::memory::Cells;

/// The devices of an MCU, its joints and its mail, for [`Devices`](super::Devices). Joints are named by their
/// indices. On an MCU without the memory, its cells are not used.
pub trait Surroundings: Cells {
    /// The half of the module that they are in.
    const HALF: Half;

    /// Starts a measurement of `quantity`.
    fn look(&mut self, quantity: Quantity);

    /// The measured value, in the quantity's unit; `None` until the measurement is done, and for a quantity
    /// that this MCU does not have.
    fn seen(&mut self, quantity: Quantity) -> Option<i16>;

    /// The end switches of the latch at `dock`.
    fn end_switches(&mut self, dock: Dock) -> EndSwitches;

    /// Drives the latch at `dock`; `None` is off.
    fn drive_latch(&mut self, dock: Dock, to: Option<End>);

    /// Closes the power switch of `dock`, or opens it. Too much current through it opens it as well.
    fn set_power(&mut self, dock: Dock, is_on: bool);

    /// The docks whose switches too much current has opened since the last call: a bit for each place.
    fn take_tripped(&mut self) -> u8;

    /// Switches the light of all docks here on or off.
    fn set_emitters(&mut self, is_on: bool);

    /// Switches the charger on or off.
    fn set_charger(&mut self, is_on: bool);

    /// Gives a joint an order. It replaces one that the joint has not begun with.
    fn order(&mut self, joint: usize, order: Order);

    /// The state of a joint; `None` if there is no such joint here.
    fn state(&mut self, joint: usize) -> Option<State>;

    /// Where a joint is, in 0.1 degree, as far as that is known.
    fn angle(&mut self, joint: usize) -> Option<i16>;

    /// Sends `payload` to another task of the module, on behalf of the device's task `from`. Returns whether
    /// there was room; else it is lost.
    fn send(&mut self, from: TaskCode, to: TaskCode, payload: Payload) -> bool;

    /// Reports to `client`, on behalf of the device's task `from`. Returns whether there was room.
    fn report(&mut self, from: TaskCode, client: TaskCode, report: Report) -> bool {
        self.send(from, client, report.to_payload())
    }

    /// Passes a request on to another device.
    fn request(&mut self, from: TaskCode, request: Request) {
        self.send(from, request.task(), request.to_payload());
    }
}
