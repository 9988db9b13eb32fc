//! The docks of one MCU: docking motors, guidance, power switches.

use super::surroundings::Surroundings;
use crate::device::Quantity;
use crate::dock::Dock;
use crate::docking::guidance::{Guidance, HELD, Line, Next};
use crate::docking::latch::{DockingMotor, End, PERIOD_MS};
use crate::message::TaskCode;
use crate::motor::joint::State;
use crate::motor::joints::Order;
use crate::power::allowance::Allowance;
use crate::power::switch::Switch;
use crate::request::{Report, Request};
use crate::superbot::LATCH_CURRENT_LIMIT;

/// The joint that turns the docks of an MCU, by its index there.
pub const JOINT: usize = 0;

/// How fast joints turn during a search, in degrees per second.
const SEARCH_SPEED: u8 = 30;

/// Periods from when the light is switched on until a reading shows its reflection: 20 ms.
const LIGHTS_UP: u8 = 20 / PERIOD_MS as u8;

/// The devices of one dock.
struct Devices {
    dock: Dock,
    motor: DockingMotor,
    /// The task that asked for the latch last.
    latch_client: TaskCode,
    switch: Switch,
    /// The task that asked for the switch last.
    switch_client: TaskCode,
}

/// A search for a neighbour's dock.
struct Search {
    dock: Dock,
    guidance: Guidance,
    /// Periods until the light is there.
    dark: u8,
    /// Whether the dock's latch was closed when the search began.
    was_latched: bool,
}

/// The three docks of one MCU. One docking motor runs at a time: their current is measured together.
pub struct Docks {
    docks: [Devices; 3],
    search: Option<Search>,
    /// Whether a search has turned the joint, until that is [taken](Self::take_turned).
    has_turned: bool,
    allowance: Allowance,
}

impl Docks {
    /// Docks whose switches are open and motors off.
    pub fn new(docks: [Dock; 3]) -> Self {
        let devices = |dock| Devices {
            dock,
            motor: DockingMotor::new(),
            latch_client: TaskCode::HORMONE,
            switch: Switch::Open,
            switch_client: TaskCode::HORMONE,
        };
        Docks { docks: docks.map(devices), search: None, has_turned: false, allowance: Allowance::ALL }
    }

    /// Whether the joint with this index is being turned to find a dock.
    pub fn searches_with(&self, joint: usize) -> bool {
        joint == JOINT && self.search.is_some()
    }

    /// Whether a search has turned the joint since this was asked last.
    pub fn take_turned(&mut self) -> bool {
        core::mem::take(&mut self.has_turned)
    }

    fn devices(&mut self, dock: Dock) -> Option<&mut Devices> {
        self.docks.iter_mut().find(|devices| devices.dock == dock)
    }

    /// Whether a docking motor other than that of `dock` runs, or a search for another dock.
    fn is_busy(&self, dock: Dock) -> bool {
        self.docks.iter().any(|other| other.dock != dock && other.motor.is_running())
            || self.search.as_ref().is_some_and(|search| search.dock != dock)
    }

    /// Moves the latch of `dock`. Refused while another motor runs or the battery is too empty.
    pub fn latch(&mut self, dock: Dock, end: End, client: TaskCode, around: &mut impl Surroundings) {
        let may = self.allowance.docking() && !self.is_busy(dock);
        if self.search.as_ref().is_some_and(|search| search.dock == dock) {
            self.break_off(around);
        }
        match self.devices(dock) {
            Some(devices) if may => {
                devices.latch_client = client;
                devices.motor.move_to(end);
            }
            _ => refuse(dock, client, around),
        }
    }

    /// Searches for the neighbour's dock in front of `dock`, and latches. If `dock` does not come near enough
    /// for that, it stays where it came nearest. A latch that is closed already stays so if it has hold of a
    /// dock by the light; if it has closed on nothing, it opens for the next time. By the light a dock close
    /// by may pass for one that is held, so the client of a latch that closes has to see whether its link
    /// hears a neighbour. A latch that moves goes on instead, and so does a search for the same dock: else
    /// one that is asked for again and again would never end. Refused as [`latch`](Self::latch) is, and while
    /// the position of the joint is not known.
    pub fn approach(&mut self, dock: Dock, client: TaskCode, around: &mut impl Surroundings) {
        let may = self.allowance.docking() && !self.is_busy(dock);
        let is_known = around.angle(JOINT).is_some();
        let (true, true, Some(devices)) = (is_known, may, self.devices(dock)) else {
            return refuse(dock, client, around);
        };
        devices.latch_client = client;
        if devices.motor.is_running() || self.search.is_some() {
            return;
        }
        let was_latched = around.end_switches(dock).is_latched;
        // A joint that is off may be elsewhere than it was. It is measured before the light is there.
        if !was_latched && !matches!(around.state(JOINT), Some(State::Moving | State::Arrived)) {
            self.stay(around);
        }
        self.search = Some(Search { dock, guidance: Guidance::new(), dark: LIGHTS_UP, was_latched });
        around.set_emitters(true);
    }

    /// Breaks the present search off, if there is one: the joints that it turns stay where they are.
    #[inline(never)] // once in flash, and keeps its stack frame out of the callers'
    pub fn break_off<S: Surroundings>(&mut self, around: &mut S) {
        let Some(Search { dock, guidance, .. }) = &self.search else { return };
        if guidance.line() == Line::Shift {
            turn_opposite(*dock, 0, around);
        }
        self.end_search(around);
        self.stay(around);
    }

    /// Keeps the joint behind the docks where it is.
    #[inline(never)] // else the order takes stack where others go deeper
    fn stay(&mut self, around: &mut impl Surroundings) {
        self.has_turned = true;
        around.order(JOINT, Order::TurnBy { by: 0, speed: SEARCH_SPEED });
    }

    /// Ends the present search.
    fn end_search(&mut self, around: &mut impl Surroundings) {
        self.search = None;
        around.set_emitters(false);
    }

    /// Closes the power switch of `dock`, or opens it. The client is told of one that stays open for now.
    pub fn set_power(&mut self, dock: Dock, is_on: bool, client: TaskCode, around: &mut impl Surroundings) {
        let is_allowed = self.allowance.neighbours();
        let Some(devices) = self.devices(dock) else { return };
        devices.switch_client = client;
        if is_on {
            devices.switch.close(is_allowed);
        } else {
            devices.switch.open();
        }
        around.set_power(dock, devices.switch.is_closed());
        if devices.switch == Switch::Shed {
            devices.tell_switch(around);
        }
    }

    /// Reports the switches that the board has opened.
    pub fn trip(&mut self, around: &mut impl Surroundings) {
        let tripped = around.take_tripped();
        for (place, devices) in (0..).zip(&mut self.docks) {
            if tripped >> place & 1 != 0 && devices.switch.trip() {
                around.set_power(devices.dock, false);
                devices.tell_switch(around);
            }
        }
    }

    /// Sheds the loads that the battery no longer allows, and takes up those that it allows again.
    pub fn allow(&mut self, allowance: Allowance, around: &mut impl Surroundings) {
        self.allowance = allowance;
        for devices in &mut self.docks {
            if devices.switch.allow(allowance.neighbours()) {
                around.set_power(devices.dock, devices.switch.is_closed());
                devices.tell_switch(around);
            }
            if !allowance.docking() && devices.motor.is_running() {
                devices.motor.stop();
                around.drive_latch(devices.dock, None);
                devices.tell_latch(around);
            }
        }
        let searching = self.search.as_ref().map(|search| search.dock);
        if let Some(dock) = searching.filter(|_| !allowance.docking()) {
            self.break_off(around);
            if let Some(devices) = self.devices(dock) {
                devices.tell_lost(around);
            }
        }
    }

    /// One period of [`PERIOD_MS`]. Returns whether any motor runs or a search goes on.
    pub fn step(&mut self, around: &mut impl Surroundings) -> bool {
        let mut is_busy = self.search.is_some();
        for devices in &mut self.docks {
            if devices.motor.is_running() {
                let current = around.seen(Quantity::LatchCurrent).unwrap_or(0);
                let switches = around.end_switches(devices.dock);
                let drive = devices.motor.step(switches, current > LATCH_CURRENT_LIMIT);
                around.drive_latch(devices.dock, drive);
                around.look(Quantity::LatchCurrent);
                if drive.is_none() {
                    devices.tell_latch(around);
                }
                is_busy = true;
            }
        }
        self.go_on_searching(around);
        is_busy
    }

    fn go_on_searching<S: Surroundings>(&mut self, around: &mut S) {
        let Some(search) = &mut self.search else { return };
        let Search { dock, was_latched, .. } = *search;
        if !was_latched && around.end_switches(dock).is_latched {
            // The neighbour has latched, and hooks that hold each other move as one.
            self.break_off(around);
            let Some(devices) = self.devices(dock) else { return };
            return devices.tell_held(around);
        }
        if search.dark > 0 {
            search.dark -= 1;
            return around.look(Quantity::Proximity(dock));
        }
        let Some(reflected) = around.seen(Quantity::Proximity(dock)) else { return };
        if was_latched {
            self.end_search(around);
            let Some(devices) = self.devices(dock) else { return };
            return if reflected >= HELD as i16 {
                devices.tell_held(around);
            } else {
                devices.motor.move_to(End::Released);
            };
        }
        let next = match around.angle(JOINT) {
            None => Next::Lost,
            Some(angle) => {
                // A joint with something in its way comes no further.
                let is_there = around.state(JOINT) != Some(State::Moving);
                let next = search.guidance.step(angle, reflected.max(0) as u16, is_there);
                if let Next::Move(line, to) = next {
                    self.has_turned = true;
                    turn(to, around);
                    if line == Line::Shift {
                        turn_opposite(dock, angle.saturating_sub(to), around);
                    }
                }
                next
            }
        };
        if matches!(next, Next::GoOn | Next::Move(..)) {
            return around.look(Quantity::Proximity(dock));
        }
        self.end_search(around);
        let Some(devices) = self.devices(dock) else { return };
        if next == Next::Latch {
            devices.motor.move_to(End::Latched);
        } else {
            devices.tell_lost(around);
        }
    }
}

/// Turns the joint behind the docks for a search.
#[inline(never)] // once in flash
fn turn(angle: i16, around: &mut impl Surroundings) {
    around.order(JOINT, Order::Turn { angle, speed: SEARCH_SPEED });
}

/// Turns the joint of the other MCU by an angle, for the search of `dock`.
#[inline(never)] // once in flash
fn turn_opposite<S: Surroundings>(dock: Dock, by: i16, around: &mut S) {
    let request = Request::TurnBy { axis: S::HALF.opposite, by, speed: SEARCH_SPEED };
    around.request(TaskCode::dock(dock), request);
}

impl Devices {
    fn tell_latch(&self, around: &mut impl Surroundings) {
        self.tell(Report::Latch(self.dock, self.motor.state()), around);
    }

    /// Reports that a search came to nothing.
    fn tell_lost(&self, around: &mut impl Surroundings) {
        self.tell(Report::Lost(self.dock), around);
    }

    /// Reports that the latch has hold of a dock without its own motor.
    fn tell_held(&self, around: &mut impl Surroundings) {
        self.tell(Report::Held(self.dock), around);
    }

    /// Reports to the task that asked for the latch last.
    fn tell(&self, report: Report, around: &mut impl Surroundings) {
        around.report(TaskCode::dock(self.dock), self.latch_client, report);
    }

    fn tell_switch(&self, around: &mut impl Surroundings) {
        let report = Report::Switch(self.dock, self.switch);
        around.report(TaskCode::dock(self.dock), self.switch_client, report);
    }
}

fn refuse(dock: Dock, client: TaskCode, around: &mut impl Surroundings) {
    let device = TaskCode::dock(dock);
    around.report(device, client, Report::Refused(device));
}
