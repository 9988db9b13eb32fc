//! The docks of an MCU in a world: docking motors and searches, as the devices' task drives them
//! ([`tasks::devices::docks`]).

use tasks::devices::docks::{NEAR, SEARCH_SPEED};
use tasks::dock::{Dock, DockSet};
use tasks::docking::guidance::{Guidance, Next};
use tasks::docking::latch::{DockingMotor, End, EndSwitches};
use tasks::message::TaskCode;
use tasks::motor::joint::State;
use tasks::motor::task::Order;
use tasks::request::Report;
use tasks::superbot::LATCH_CURRENT_LIMIT;

use super::joints::Joints;
use crate::body::Body;

pub struct Docks {
    docks: [(Dock, DockingMotor); 3],
    search: Option<Search>,
}

/// A search for a neighbour's dock.
struct Search {
    dock: Dock,
    /// Where the joint was, in 0.1 degree.
    start: i16,
    guidance: Guidance,
    /// The joint turns, rather than that the light is measured.
    is_turning: bool,
}

impl Docks {
    /// Docks whose motors are off.
    pub fn new(docks: [Dock; 3]) -> Self {
        Docks { docks: docks.map(|dock| (dock, DockingMotor::new())), search: None }
    }

    /// Moves the latch of `dock`. Returns whether it may: one motor runs at a time.
    pub fn latch(&mut self, dock: Dock, end: End) -> bool {
        let may = !self.is_busy(dock);
        self.search.take_if(|search| search.dock == dock);
        self.docks.iter_mut().filter(|it| may && it.0 == dock).for_each(|(_, motor)| motor.move_to(end));
        may
    }

    /// Searches for the neighbour's dock before `dock`, and latches. Returns whether it may: likewise, and
    /// while somebody knows where the joint is.
    pub fn approach(&mut self, dock: Dock, angle: Option<i16>) -> bool {
        let Some(start) = angle.filter(|_| !self.is_busy(dock)) else { return false };
        self.search = Some(Search { dock, start, guidance: Guidance::new(start, NEAR), is_turning: false });
        true
    }

    /// Whether a docking motor other than that of `dock` runs, or a search for another dock.
    fn is_busy(&self, dock: Dock) -> bool {
        self.docks.iter().any(|(other, motor)| *other != dock && motor.is_running())
            || self.search.as_ref().is_some_and(|search| search.dock != dock)
    }

    pub fn docks(&self) -> impl Iterator<Item = Dock> {
        self.docks.iter().map(|it| it.0)
    }

    pub fn is_searching(&self) -> bool {
        self.search.is_some()
    }

    /// The docks that send out light: all while one of them searches.
    pub fn looking(&self) -> DockSet {
        if self.is_searching() { DockSet::of(&self.docks.each_ref().map(|it| it.0)) } else { DockSet::EMPTY }
    }

    /// One period of [`PERIOD_MS`](tasks::docking::latch::PERIOD_MS). Sets where docking motors drive their
    /// latches.
    pub fn step(
        &mut self,
        body: &Body,
        joints: &mut Joints,
        latches: &mut [i8; 6],
        reports: &mut Vec<(TaskCode, Report)>,
    ) {
        let amperes: f64 = self.docks.iter().map(|(dock, _)| body.latch(*dock).amperes()).sum();
        let is_strained = amperes * 1000.0 > f64::from(LATCH_CURRENT_LIMIT);
        for (dock, motor) in &mut self.docks {
            let drive = &mut latches[usize::from(dock.index())];
            *drive = 0;
            if motor.is_running() {
                let latch = body.latch(*dock);
                let switches =
                    EndSwitches { is_released: latch.is_released(), is_latched: latch.is_latched() };
                match motor.step(switches, is_strained) {
                    Some(End::Latched) => *drive = 1,
                    Some(End::Released) => *drive = -1,
                    None => reports.push((TaskCode::dock(*dock), Report::Latch(*dock, motor.state()))),
                }
            }
        }
        self.go_on_searching(body, joints, reports);
    }

    fn go_on_searching(&mut self, body: &Body, joints: &mut Joints, reports: &mut Vec<(TaskCode, Report)>) {
        let Some(search) = &mut self.search else { return };
        let next = match (search.is_turning, joints.state()) {
            (true, State::Moving) => return,
            (true, State::Arrived) => {
                search.is_turning = false;
                return;
            }
            (true, _) => Next::Lost,
            (false, _) => search.guidance.step(body.reflected(search.dock)),
        };
        let turn = |angle| Order::Turn { angle, speed: SEARCH_SPEED };
        let (dock, start) = (search.dock, search.start);
        match next {
            Next::Turn(angle) => {
                search.is_turning = true;
                joints.order(joints.first(), turn(angle));
            }
            Next::Latch => {
                self.search = None;
                self.latch(dock, End::Latched);
            }
            Next::Lost => {
                self.search = None;
                joints.order(joints.first(), turn(start));
                reports.push((TaskCode::dock(dock), Report::Lost(dock)));
            }
        }
    }
}
