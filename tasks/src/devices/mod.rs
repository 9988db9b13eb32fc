//! The tasks of an MCU's devices besides links, bus and the joints' control: docking motors, guidance,
//! sensors, power, memory.
//!
//! Each is a small state machine that takes requests and is stepped, and runs to completion: they share one
//! stack, one mailbox and one [task]. Stacks of their own would take about 120 bytes each, and there are
//! seven of these on the master and five on the slave.
//!
//! [`Devices`] holds them all. Its caller hands over [each message](Devices::receive) as it comes, and
//! [polls](Devices::poll) after messages, when a joint has changed its state by itself, when a power switch
//! has opened, and when it is [due](Devices::next_due).
//!
//! | file | what |
//! |---|---|
//! | [`surroundings`] | what they measure, move and tell |
//! | [`docks`] | the docking motors, guidance and power switches of three docks |
//! | [`sensors`] | readings on demand |
//! | [`supply`] | the battery and its charger, on the MCU that has them |
//! | [`memory`] | a record that keeps without power, on the MCU that has it |
//! | [`task`] | hands them their messages, and sleeps as long as none has anything to do |

use kernel::{Ticks, is_reached};

use crate::docking::latch::PERIOD_MS;
use crate::message::{Letter, TaskCode};
use crate::motor::Axis;
use crate::motor::joint::State;
use crate::motor::joints::Order;
use crate::power::allowance::Allowance;
use crate::request::{Report, Request};
use docks::{Docks, JOINT};
use memory::Memory;
use sensors::Sensors;
use supply::Supply;
use surroundings::Surroundings;

pub mod docks;
pub mod memory;
pub mod sensors;
pub mod supply;
pub mod surroundings;
pub mod task;

/// How often the battery is looked at, in ticks of 1 ms.
const LOOK: Ticks = 250;

/// The content of a message to the devices.
pub enum Mail {
    /// A request, and the task that it is from.
    Request(Request, TaskCode),
    /// A report of devices of the other MCU to the battery's.
    Report(Report),
}

impl Mail {
    /// The content of `letter`, for devices in such surroundings; `None` if it can't be read, or requests
    /// something of another device than the one that it is for.
    pub fn of<S: Surroundings>(letter: &Letter) -> Option<Mail> {
        let report = if S::HALF.has_battery { Report::from_payload(letter.payload()) } else { None };
        let request = || {
            let request = Request::from_payload(letter.payload())?;
            (request.task() == letter.to().task()).then(|| Mail::Request(request, letter.from().task()))
        };
        report.map(Mail::Report).or_else(request)
    }
}

/// A joint as its clients know it.
#[derive(Clone, Copy)]
struct Client {
    axis: Axis,
    /// The task that asked last, and the state that was told last.
    client: TaskCode,
    told: State,
    /// Whether a search has turned it since.
    is_searching: bool,
}

impl Client {
    /// The client of a joint that no task has asked anything. That the joint is off will be told: if this MCU
    /// alone was reset, others do not know it yet.
    const fn of(axis: Axis) -> Self {
        Client { axis, client: TaskCode::HORMONE, told: State::Moving, is_searching: false }
    }
}

/// All devices that the task serves.
pub struct Devices<const N: usize> {
    joints: [Client; N],
    docks: Docks,
    sensors: Sensors,
    supply: Supply,
    memory: Memory,
    /// Whether the kept record was told.
    is_recalled: bool,
    allowance: Allowance,
    next_look: Ticks,
    next_step: Ticks,
    is_busy: bool,
}

impl<const N: usize> Devices<N> {
    /// The devices around, with joints by `axes` in the order of their indices, from `now` on.
    #[inline(never)] // apart, this takes less flash than within the task's large frame
    pub fn new<S: Surroundings>(axes: [Axis; N], now: Ticks, around: &mut S) -> Self {
        let mut supply = Supply::new();
        if S::HALF.has_battery {
            supply.prepare(around);
        }
        Devices {
            joints: axes.map(Client::of),
            docks: Docks::new(S::HALF.docks()),
            sensors: Sensors::new(),
            supply,
            memory: Memory::new(),
            is_recalled: false,
            allowance: Allowance::ALL,
            next_look: now.wrapping_add(LOOK),
            next_step: now.wrapping_add(PERIOD_MS),
            is_busy: S::HALF.has_memory,
        }
    }

    /// Handles a message, which is taken at `now`.
    #[inline(never)] // as `new`
    pub fn receive<S: Surroundings>(&mut self, now: Ticks, mail: Mail, around: &mut S) {
        match mail {
            Mail::Report(report) => self.supply.hear(report),
            Mail::Request(request, client) => self.serve(request, client, around),
        }
        if !self.is_busy {
            self.is_busy = true;
            self.next_step = now.wrapping_add(PERIOD_MS);
        }
    }

    /// Does what is due.
    #[inline(always)] // a frame of its own would take stack
    pub fn poll<S: Surroundings>(&mut self, now: Ticks, around: &mut S) {
        self.tell_joints(around);
        self.docks.trip(around);
        if self.is_busy && is_reached(self.next_step, now) {
            self.next_step = now.wrapping_add(PERIOD_MS);
            let is_docking = self.docks.step(around);
            let is_storing = S::HALF.has_memory && self.remember(around);
            self.is_busy = self.sensors.step(around) || is_docking || is_storing;
        }
        if S::HALF.has_battery && is_reached(self.next_look, now) {
            self.next_look = now.wrapping_add(LOOK);
            self.look(around);
        }
    }

    /// Ticks from `now` until [`poll`](Self::poll) has something to do; `None` if it waits for others only.
    #[inline(always)]
    pub fn next_due<S: Surroundings>(&self, now: Ticks) -> Option<Ticks> {
        if self.is_busy {
            Some(self.next_step.wrapping_sub(now))
        } else {
            S::HALF.has_battery.then(|| self.next_look.wrapping_sub(now))
        }
    }

    fn serve<S: Surroundings>(&mut self, request: Request, client: TaskCode, around: &mut S) {
        match request {
            Request::Read(sensor) => self.sensors.read(sensor, client, around),
            Request::Turn { axis, angle, speed } => {
                self.turn(axis, Order::Turn { angle, speed }, client, around);
            }
            Request::TurnBy { axis, by, speed } => {
                self.turn(axis, Order::TurnBy { by, speed }, client, around);
            }
            Request::Relax(axis) => {
                if let Some(index) = self.joint(axis) {
                    around.order(index, Order::Relax);
                }
            }
            Request::Latch(dock, end) => self.docks.latch(dock, end, client, around),
            Request::Approach(dock) => self.docks.approach(dock, client, around),
            Request::Leave(_) => self.docks.break_off(around),
            Request::Power { dock, is_on } => self.docks.set_power(dock, is_on, client, around),
            Request::Charge { is_on } => {
                if S::HALF.has_battery {
                    self.supply.charge(is_on, client, around);
                    self.allow(self.supply.allowance(), around);
                }
            }
            Request::Allow(allowance) => self.allow(allowance, around),
            Request::Keep(record) => self.memory.keep(record),
        }
    }

    /// First tells HORMONE the record that was kept before, then writes the one that is to be kept. Returns
    /// whether there is more to do.
    #[inline(never)] // as `new`
    fn remember(&mut self, around: &mut impl Surroundings) -> bool {
        if !around.is_ready() {
            return true;
        }
        if !self.is_recalled {
            // A report that finds no room is repeated the next time.
            self.is_recalled = self.memory.recall(around).is_none_or(|record| {
                around.report(TaskCode::MEMORY, TaskCode::HORMONE, Report::Kept(record))
            });
        }
        !self.is_recalled || self.memory.step(around)
    }

    /// The index of a joint among those of this MCU.
    fn joint(&self, axis: Axis) -> Option<usize> {
        self.joints.iter().position(|joint| joint.axis == axis)
    }

    /// Turns a joint. A behaviour that asks for it is told what becomes of it. A dock of the other MCU asks
    /// for a search: the behaviour that asked last still is told, but not that the joint stalls against what
    /// it is to move.
    fn turn(&mut self, axis: Axis, order: Order, client: TaskCode, around: &mut impl Surroundings) {
        let device = TaskCode::joint(axis);
        let is_search = !client.is_behaviour();
        let Some(index) = self.joint(axis).filter(|_| self.allowance.joints()) else {
            if !is_search {
                around.report(device, client, Report::Refused(device));
            }
            return;
        };
        self.note_search();
        if let Some(joint) = self.joints.get_mut(index) {
            if is_search {
                joint.is_searching = true;
            } else {
                *joint = Client { client, ..Client::of(axis) };
            }
        }
        around.order(index, order);
    }

    /// A joint that a search here has turned counts like one that a search on the other MCU has turned.
    fn note_search(&mut self) {
        if self.docks.take_turned()
            && let Some(joint) = self.joints.get_mut(JOINT)
        {
            joint.is_searching = true;
        }
    }

    /// Reports the joints that have changed their state by themselves, except one that a search turns: the
    /// search sees to that.
    fn tell_joints(&mut self, around: &mut impl Surroundings) {
        self.note_search();
        for (index, joint) in self.joints.iter_mut().enumerate() {
            let Some(state) = around.state(index) else { continue };
            let is_news = state != joint.told && state != State::Moving;
            let pushes = joint.is_searching && state == State::Stalled;
            let is_due = is_news && !pushes && !self.docks.searches_with(index);
            let report = Report::Joint(joint.axis, state);
            // A report that finds no room is repeated the next time.
            if !is_due || around.report(TaskCode::joint(joint.axis), joint.client, report) {
                joint.told = state;
            }
        }
    }

    #[inline(never)] // as `new`
    fn look(&mut self, around: &mut impl Surroundings) {
        let allowance = self.supply.look(around);
        self.supply.prepare(around);
        if let Some(allowance) = allowance {
            self.allow(allowance, around);
        }
    }

    /// Sheds the loads that the battery no longer allows, and takes up those that it allows again.
    fn allow(&mut self, allowance: Allowance, around: &mut impl Surroundings) {
        let were_allowed = core::mem::replace(&mut self.allowance, allowance).joints();
        self.docks.allow(allowance, around);
        for (index, joint) in self.joints.iter_mut().enumerate() {
            if !allowance.joints() {
                around.order(index, Order::Relax);
            } else if !were_allowed {
                // That the joint is off is told again: requests to it were refused meanwhile.
                *joint = Client { client: joint.client, ..Client::of(joint.axis) };
            }
        }
    }
}
