//! The bridge and the devices as turns of the loop; [`tasks::bridge::task`] and [`tasks::devices::task`] run
//! them as tasks.

use board::twi::Interface;
use kernel::{Task, Ticks, now};
use tasks::bridge::task::{Bridge, Crossing};
use tasks::device::Peripherals;
use tasks::devices::Devices;
use tasks::devices::task::Desk;
use tasks::mailbox::Mailbox;
use tasks::motor::Axis;
use tasks::post_office::PostOffice;

/// The bridge to the other MCU.
pub struct Bridging {
    bridge: &'static Bridge,
    bus: Interface,
    office: &'static PostOffice,
    crossing: Crossing,
}

impl Bridging {
    /// The `bridge` over `bus`.
    pub fn new(bridge: &'static Bridge, bus: Interface, office: &'static PostOffice) -> Self {
        Bridging { bridge, bus, office, crossing: Crossing::new() }
    }

    /// Takes its turn and returns the time of the next one if nothing is posted before.
    #[inline(never)] // its stack is needed here alone
    pub fn turn(&mut self, task: &mut Task) -> Option<Ticks> {
        let left = self.crossing.turn(task, self.bridge, &mut self.bus, self.office)?;
        Some(now(task).wrapping_add(left))
    }
}

/// All devices but the links, the bridge and the joints.
pub struct Serving<P, const N: usize> {
    mailbox: &'static Mailbox,
    board: P,
    desk: &'static Desk<N>,
    devices: Devices<N>,
}

impl<P: Peripherals, const N: usize> Serving<P, N> {
    /// The devices of `board`, with requests in `mailbox`.
    pub fn new(
        task: &mut Task,
        mailbox: &'static Mailbox,
        mut board: P,
        axes: [Axis; N],
        desk: &'static Desk<N>,
    ) -> Self {
        let devices = desk.begin(task, &mut board, axes);
        Serving { mailbox, board, desk, devices }
    }

    /// Takes its turn and returns the time of the next one if nothing is posted before.
    #[inline(never)] // its stack is needed here alone
    pub fn turn(&mut self, task: &mut Task) -> Option<Ticks> {
        let left = self.desk.turn(task, self.mailbox, &mut self.board, &mut self.devices);
        Some(now(task).wrapping_add(left))
    }
}
