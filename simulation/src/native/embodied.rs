//! A module that has a body in a world: its motors, driven by the code that drives them on the MCUs.

use tasks::dock::{Dock, DockSet};
use tasks::docking::latch::PERIOD_MS;
use tasks::message::TaskCode;
use tasks::motor::Axis;
use tasks::motor::task::Order;
use tasks::request::{Report, Request};
use tasks::router::Mcu;
use tasks::superbot::{MASTER, MASTER_AXES, SLAVE, SLAVE_AXES};

use super::docks::Docks;
use super::joints::Joints;
use crate::body::{Body, Drives};
use crate::hardware::is_on_slave;

/// A millisecond, in s.
const SECONDS: f64 = 1e-3;

pub struct Embodied {
    pub body: Body,
    /// The master's and the slave's.
    halves: [Half; 2],
    drives: Drives,
    milliseconds: u16,
    /// What devices have to tell HORMONE, and which.
    reports: Vec<(TaskCode, Report)>,
}

/// The devices of an MCU.
struct Half {
    joints: Joints,
    docks: Docks,
}

impl Half {
    fn of(mcu: Mcu) -> Self {
        let (axes, docks): (&[Axis], _) = match mcu {
            Mcu::Master => (&MASTER_AXES, MASTER.docks()),
            Mcu::Slave => (&SLAVE_AXES, SLAVE.docks()),
        };
        Half { joints: Joints::new(axes), docks: Docks::new(docks) }
    }
}

impl Embodied {
    /// A module at power-up.
    pub fn new() -> Self {
        Embodied {
            body: Body::default(),
            halves: [Mcu::Master, Mcu::Slave].map(Half::of),
            drives: Drives::default(),
            milliseconds: 0,
            reports: Vec::new(),
        }
    }

    fn half(&mut self, dock: Dock) -> &mut Half {
        &mut self.halves[usize::from(is_on_slave(dock))]
    }

    /// Does what is asked for, but for sensors and power.
    pub fn serve(&mut self, request: Request) {
        let may = match request {
            Request::Turn { axis, angle, speed } => {
                self.order(axis, Order::Turn { angle, speed });
                true
            }
            Request::Relax(axis) => {
                self.order(axis, Order::Relax);
                true
            }
            Request::Latch(dock, end) => self.half(dock).docks.latch(dock, end),
            Request::Approach(dock) => {
                let Half { joints, docks } = self.half(dock);
                docks.approach(dock, joints.angle())
            }
            _ => true,
        };
        if !may {
            self.reports.push((request.task(), Report::Refused(request.task())));
        }
    }

    fn order(&mut self, axis: Axis, order: Order) {
        self.halves.iter_mut().for_each(|half| half.joints.order(axis, order));
    }

    /// Lets a millisecond begin, in which these MCUs run, the master and the slave. Returns what there is to
    /// tell HORMONE, and whose task does.
    pub fn step(&mut self, runs: [bool; 2]) -> Vec<(TaskCode, Report)> {
        self.milliseconds = self.milliseconds.wrapping_add(1);
        let Embodied { body, halves, drives, reports, .. } = self;
        *drives = Drives { latches: drives.latches, ..Drives::default() };
        for (Half { joints, docks }, runs) in halves.iter_mut().zip(runs) {
            if !runs {
                docks.docks().for_each(|dock| drives.latches[usize::from(dock.index())] = 0);
                continue;
            }
            joints.step(body, &mut drives.duties);
            joints.tell(docks.is_searching(), reports);
            if self.milliseconds.is_multiple_of(PERIOD_MS) {
                docks.step(body, joints, &mut drives.latches, reports);
            }
        }
        body.step(drives, SECONDS);
        std::mem::take(reports)
    }

    /// The docks that send out light, to look for others.
    pub fn looking(&self) -> DockSet {
        let [master, slave] = self.halves.each_ref().map(|half| half.docks.looking());
        master.union(slave)
    }

    /// Programs start over.
    pub fn reset(&mut self, is_reset: impl Fn(Mcu) -> bool) {
        for mcu in [Mcu::Master, Mcu::Slave].into_iter().filter(|mcu| is_reset(*mcu)) {
            self.halves[mcu as usize] = Half::of(mcu);
        }
    }
}
