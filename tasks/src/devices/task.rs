//! The devices' task, one on each MCU.

use kernel::{Never, Task, Ticks, now};

use super::desk::Desk;
use super::docks::Docks;
use super::sensors::Sensors;
use super::supply::Supply;
use crate::device::Peripherals;
use crate::docking::latch::PERIOD_MS;
use crate::mailbox::Mailbox;
use crate::message::TaskCode;
use crate::motor::Axis;
use crate::motor::joint::State;
use crate::motor::task::{Motors, Order};
use crate::post_office::PostOffice;
use crate::power::allowance::Allowance;
use crate::request::{Report, Request};

/// How often the battery is looked at, in ticks of 1 ms.
const LOOK: Ticks = 250;

/// How often the task shows at least that it is alive, likewise.
pub const ALIVE: Ticks = 50;

/// A joint as its clients know it.
#[derive(Clone, Copy)]
pub struct Client {
    axis: Axis,
    /// Who asked last, and the state that was told last.
    client: TaskCode,
    told: State,
}

impl Client {
    /// Of a joint that nobody has asked anything. That it is off will be told: where this MCU alone was
    /// reset, others do not know it yet.
    pub const fn of(axis: Axis) -> Self {
        Client { axis, client: TaskCode::HORMONE, told: State::Moving }
    }
}

/// All devices that the task serves.
pub struct Devices<P, const N: usize> {
    board: P,
    motors: &'static Motors<N>,
    joints: [Client; N],
    desk: Desk,
    docks: Docks,
    sensors: Sensors,
    supply: Supply,
    allowance: Allowance,
}

/// Runs the task on `mailbox`: the devices of `board`, and the joints of `motors`, by `axes` in their order.
/// `alive` is called every [`ALIVE`] ticks or sooner.
pub fn run<P: Peripherals, const N: usize>(
    task: &mut Task,
    mailbox: &'static Mailbox,
    board: P,
    motors: &'static Motors<N>,
    axes: [Axis; N],
    office: &'static PostOffice,
    mut alive: impl FnMut(&mut Task),
) -> Never {
    let mut devices = Devices::new(board, motors, axes, office);
    let mut schedule = Schedule::begin(task, &mut devices);
    loop {
        let rest = schedule.turn(task, mailbox, &mut devices);
        alive(task);
        mailbox.wake_in(task, rest);
        mailbox.wait(task);
    }
}

/// When which device is due: for whoever drives them.
pub struct Schedule {
    next_look: Ticks,
    next_step: Ticks,
    is_busy: bool,
}

impl Schedule {
    /// From now on.
    #[inline(always)] // a frame of its own would take stack
    pub fn begin<P: Peripherals, const N: usize>(task: &mut Task, devices: &mut Devices<P, N>) -> Self {
        let start = now(task);
        if P::HAS_BATTERY {
            devices.supply.prepare(task, &mut devices.desk, &mut devices.board);
        }
        Schedule { next_look: start.wrapping_add(LOOK), next_step: start, is_busy: false }
    }

    /// Does all that there is to do: at first, after each signal of the mailbox, and after so many ticks as it
    /// returns.
    #[inline(always)] // a frame of its own would take stack
    pub fn turn<P: Peripherals, const N: usize>(
        &mut self,
        task: &mut Task,
        mailbox: &'static Mailbox,
        devices: &mut Devices<P, N>,
    ) -> Ticks {
        while let Some(message) = mailbox.take(task) {
            let client = message.from().task();
            let request = Request::from_payload(message.payload());
            let report = if P::HAS_BATTERY { Report::from_payload(message.payload()) } else { None };
            // Its buffer is needed for what goes out.
            drop(message);
            match report {
                Some(report) => devices.supply.hear(report),
                None => devices.serve(task, request, client),
            }
            if !self.is_busy {
                self.is_busy = true;
                self.next_step = now(task).wrapping_add(PERIOD_MS);
            }
        }
        devices.tell_joints(task);
        devices.docks.trip(task, &mut devices.desk, &mut devices.board);
        let time = now(task);
        if self.is_busy && is_reached(self.next_step, time) {
            self.next_step = time.wrapping_add(PERIOD_MS);
            self.is_busy = devices.step(task);
        }
        if P::HAS_BATTERY && is_reached(self.next_look, time) {
            self.next_look = time.wrapping_add(LOOK);
            devices.look(task);
        }
        if self.is_busy {
            self.next_step.wrapping_sub(time)
        } else if P::HAS_BATTERY {
            self.next_look.wrapping_sub(time).min(ALIVE)
        } else {
            ALIVE
        }
    }
}

/// Whether `time` is `deadline` or after it.
fn is_reached(deadline: Ticks, time: Ticks) -> bool {
    time.wrapping_sub(deadline) <= kernel::LONGEST
}

impl<P: Peripherals, const N: usize> Devices<P, N> {
    // Apart, these three take less flash than within the task's large frame.
    /// The devices of `board`, and the joints of `motors`, by `axes` in their order.
    #[inline(never)]
    pub fn new(board: P, motors: &'static Motors<N>, axes: [Axis; N], office: &'static PostOffice) -> Self {
        Devices {
            board,
            motors,
            joints: axes.map(Client::of),
            desk: Desk::new(office),
            docks: Docks::new(P::docks()),
            sensors: Sensors::new(),
            supply: Supply::new(),
            allowance: Allowance::ALL,
        }
    }

    #[inline(never)]
    fn serve(&mut self, task: &mut Task, request: Option<Request>, client: TaskCode) {
        let Devices { board, motors, desk, docks, sensors, supply, .. } = self;
        match request {
            Some(Request::Read(sensor)) => sensors.read(task, desk, board, sensor, client),
            Some(Request::Turn { axis, angle, speed }) => self.turn(task, axis, angle, speed, client),
            Some(Request::Relax(axis)) => {
                if let Some(index) = self.joint(axis) {
                    self.motors.order(task, index, Order::Relax);
                }
            }
            Some(Request::Latch(dock, end)) => docks.latch(task, desk, dock, end, client),
            Some(Request::Approach(dock)) => docks.approach(task, desk, board, motors, dock, client),
            Some(Request::Power { dock, is_on }) => docks.set_power(task, board, dock, is_on, client),
            Some(Request::Charge { is_on }) => {
                if P::HAS_BATTERY {
                    supply.charge(task, desk, board, is_on);
                    let allowance = supply.allowance();
                    self.allow(task, allowance);
                }
            }
            Some(Request::Allow(allowance)) => self.allow(task, allowance),
            None => desk.malformed = desk.malformed.wrapping_add(1),
        }
    }

    /// The index of a joint among those of this MCU.
    fn joint(&self, axis: Axis) -> Option<usize> {
        self.joints.iter().position(|joint| joint.axis == axis)
    }

    fn turn(&mut self, task: &mut Task, axis: Axis, angle: i16, speed: u8, client: TaskCode) {
        let device = TaskCode::joint(axis);
        let Some(index) = self.joint(axis).filter(|_| self.allowance.joints()) else {
            return self.desk.report(task, device, client, Report::Refused(device));
        };
        if let Some(joint) = self.joints.get_mut(index) {
            joint.client = client;
            joint.told = State::Moving;
        }
        self.motors.order(task, index, Order::Turn { angle, speed });
    }

    /// Tells of the joints that have changed their state by themselves. One that a search turns is that
    /// search's business.
    fn tell_joints(&mut self, task: &mut Task) {
        for (index, joint) in self.joints.iter_mut().enumerate() {
            let Some(state) = self.motors.state(task, index) else { continue };
            let is_news = state != joint.told && state != State::Moving;
            joint.told = state;
            if is_news && !self.docks.searches_with(index) {
                let report = Report::Joint(joint.axis, state);
                self.desk.report(task, TaskCode::joint(joint.axis), joint.client, report);
            }
        }
    }

    /// One period. Returns whether there is anything left to do.
    fn step(&mut self, task: &mut Task) -> bool {
        let Devices { board, motors, desk, docks, sensors, .. } = self;
        let is_docking = docks.step(task, desk, board, motors);
        sensors.step(task, desk, board) || is_docking
    }

    #[inline(never)]
    fn look(&mut self, task: &mut Task) {
        let allowance = self.supply.look(task, &mut self.desk, &mut self.board);
        self.supply.prepare(task, &mut self.desk, &mut self.board);
        if let Some(allowance) = allowance {
            self.allow(task, allowance);
        }
    }

    /// Sheds or takes up what the battery allows.
    fn allow(&mut self, task: &mut Task, allowance: Allowance) {
        self.allowance = allowance;
        self.docks.allow(task, &mut self.desk, &mut self.board, allowance);
        if !allowance.joints() {
            for index in 0..N {
                self.motors.order(task, index, Order::Relax);
            }
        }
    }
}
