//! Requests of behaviours to devices, and reports of devices: the payloads of the messages between them.
//!
//! A request goes to the task of its device ([`Request::task`]), on whichever MCU that runs. The device
//! reports, at once or later, to the task that last asked it something. Reports that concern the whole module
//! go to HORMONE.

use crate::devices::memory::Record;
use crate::dock::Dock;
use crate::docking::latch::{self, End};
use crate::message::TaskCode;
use crate::motor::Axis;
use crate::motor::joint;
use crate::power::allowance::Allowance;
use crate::power::battery::Level;
use crate::power::charger;
use crate::power::switch::Switch;
use crate::sensor::Sensor;

/// The most bytes of a request or report.
const LENGTH: usize = 5;

/// The payload of a request or report: kind, device, and what there is to say.
pub type Payload = [u8; LENGTH];

/// A behaviour's request to a device.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub enum Request {
    /// A sensor's value.
    Read(Sensor),
    /// Turn a joint to an angle, in 0.1 degree, at no more than so many degrees per second.
    Turn { axis: Axis, angle: i16, speed: u8 },
    /// Turn a joint, from where it is, by so much, in 0.1 degree, at no more than so many degrees per second.
    /// The search that asks for it gets no report: it sees the effect itself.
    TurnBy { axis: Axis, by: i16, speed: u8 },
    /// Switch a joint's motor off. The task that asked for the joint's last turn is told: it may turn the
    /// joint again.
    Relax(Axis),
    /// Move a dock's latch.
    Latch(Dock, End),
    /// Find the neighbour's dock with the joints that bend this module, and latch.
    Approach(Dock),
    /// Break off the search that goes on with the joint behind this dock: the joints stay where they are.
    /// Nothing is reported of the search any more.
    Leave(Dock),
    /// Close a dock's power switch, or open it.
    Power { dock: Dock, is_on: bool },
    /// Charge the battery through whichever dock is closed, or stop that.
    Charge { is_on: bool },
    /// From the task with the battery to its counterpart: shed what this no longer allows, take up what it
    /// does.
    Allow(Allowance),
    /// Keep this record without power, instead of the one kept before.
    Keep(Record),
}

impl Request {
    /// The task that serves it.
    pub fn task(self) -> TaskCode {
        match self {
            Request::Read(sensor) => sensor.task(),
            Request::Turn { axis, .. } | Request::TurnBy { axis, .. } | Request::Relax(axis) => {
                TaskCode::joint(axis)
            }
            Request::Latch(dock, _)
            | Request::Approach(dock)
            | Request::Leave(dock)
            | Request::Power { dock, .. } => TaskCode::dock(dock),
            Request::Charge { .. } => TaskCode::POWER,
            Request::Allow(_) => TaskCode::POWER_BEYOND,
            Request::Keep(_) => TaskCode::MEMORY,
        }
    }

    /// As a message's payload.
    pub fn to_payload(self) -> Payload {
        match self {
            Request::Read(sensor) => [0, sensor.code(), 0, 0, 0],
            Request::Turn { axis, angle, speed } => {
                let [low, high] = angle.to_le_bytes();
                [1, axis.index(), low, high, speed]
            }
            Request::Relax(axis) => [2, axis.index(), 0, 0, 0],
            Request::Latch(dock, end) => [3, dock.index(), (end == End::Latched).into(), 0, 0],
            Request::Approach(dock) => [4, dock.index(), 0, 0, 0],
            Request::Power { dock, is_on } => [5, dock.index(), is_on.into(), 0, 0],
            Request::Charge { is_on } => [6, 0, is_on.into(), 0, 0],
            Request::TurnBy { axis, by, speed } => {
                let [low, high] = by.to_le_bytes();
                [8, axis.index(), low, high, speed]
            }
            Request::Allow(Allowance { level, is_charging }) => [7, is_charging.into(), level as u8, 0, 0],
            Request::Keep([a, b, c, d]) => [9, a, b, c, d],
            Request::Leave(dock) => [10, dock.index(), 0, 0, 0],
        }
    }

    /// The request in a payload; `None` if it is none.
    pub fn from_payload(payload: &[u8]) -> Option<Request> {
        let &[kind, device, low, high, speed] = payload else { return None };
        Some(match kind {
            0 => Request::Read(Sensor::from_code(device)?),
            1 => {
                let angle = i16::from_le_bytes([low, high]);
                Request::Turn { axis: Axis::from_index(device)?, angle, speed }
            }
            2 => Request::Relax(Axis::from_index(device)?),
            3 => {
                let end = if bool_from(low)? { End::Latched } else { End::Released };
                Request::Latch(Dock::from_index(device)?, end)
            }
            4 => Request::Approach(Dock::from_index(device)?),
            5 => Request::Power { dock: Dock::from_index(device)?, is_on: bool_from(low)? },
            6 => Request::Charge { is_on: bool_from(low)? },
            7 => {
                let (level, is_charging) = (Level::from_code(low)?, bool_from(device)?);
                Request::Allow(Allowance { level, is_charging })
            }
            8 => {
                let by = i16::from_le_bytes([low, high]);
                Request::TurnBy { axis: Axis::from_index(device)?, by, speed }
            }
            9 => Request::Keep([device, low, high, speed]),
            10 => Request::Leave(Dock::from_index(device)?),
            _ => return None,
        })
    }
}

/// A device's report.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub enum Report {
    /// A sensor's value, in its unit.
    Value(Sensor, i16),
    /// A joint is now in this state.
    Joint(Axis, joint::State),
    /// A dock's latch is now in this state.
    Latch(Dock, latch::State),
    /// No dock was found near this one.
    Lost(Dock),
    /// A dock's latch has hold of another dock: it was closed already, or the other one has latched.
    Held(Dock),
    /// A dock's power switch is now in this state.
    Switch(Dock, Switch),
    /// The battery is now this full.
    Battery(Level),
    /// The charger is now in this state.
    Charger(charger::State),
    /// The device can't do now what it was asked for, as when the battery is too empty or another dock's
    /// motor runs.
    Refused(TaskCode),
    /// This record was kept without power; told when the device's program starts.
    Kept(Record),
}

impl Report {
    /// As a message's payload.
    pub fn to_payload(self) -> Payload {
        match self {
            Report::Value(sensor, value) => {
                let [low, high] = value.to_le_bytes();
                [0x10, sensor.code(), low, high, 0]
            }
            Report::Joint(axis, state) => [0x11, axis.index(), state.code(), 0, 0],
            Report::Latch(dock, state) => [0x12, dock.index(), state.code(), 0, 0],
            Report::Lost(dock) => [0x13, dock.index(), 0, 0, 0],
            Report::Switch(dock, switch) => [0x14, dock.index(), switch as u8, 0, 0],
            Report::Battery(level) => [0x15, 0, level as u8, 0, 0],
            Report::Charger(state) => [0x16, 0, state as u8, 0, 0],
            Report::Refused(task) => [0x17, task.code(), 0, 0, 0],
            Report::Kept([a, b, c, d]) => [0x18, a, b, c, d],
            Report::Held(dock) => [0x19, dock.index(), 0, 0, 0],
        }
    }

    /// The joint and its state, if a payload is [`Report::Joint`]: for callers that want no other report, in
    /// a tenth of the flash.
    pub fn of_joint(payload: &[u8]) -> Option<(Axis, joint::State)> {
        let &[0x11, axis, state, _, _] = payload else { return None };
        Some((Axis::from_index(axis)?, joint::State::from_code(state)?))
    }

    /// The dock whose motor has closed its latch, if that is what a payload tells: for callers as those of
    /// [`of_joint`](Self::of_joint).
    pub fn latched(payload: &[u8]) -> Option<Dock> {
        const LATCHED: u8 = latch::State::At(End::Latched).code();
        let &[0x12, dock, LATCHED, _, _] = payload else { return None };
        Dock::from_index(dock)
    }

    /// The value of `sensor`, if that is what a payload tells: for callers as those of
    /// [`of_joint`](Self::of_joint).
    pub fn value_of(sensor: Sensor, payload: &[u8]) -> Option<i16> {
        let &[0x10, code, low, high, _] = payload else { return None };
        (code == sensor.code()).then_some(i16::from_le_bytes([low, high]))
    }

    /// The kept record, if that is what a payload tells: for callers as those of
    /// [`of_joint`](Self::of_joint).
    pub fn kept(payload: &[u8]) -> Option<Record> {
        let &[0x18, a, b, c, d] = payload else { return None };
        Some([a, b, c, d])
    }

    /// The report in a payload; `None` if it is none.
    pub fn from_payload(payload: &[u8]) -> Option<Report> {
        let &[kind, device, low, _, _] = payload else { return None };
        Some(match kind {
            0x10 => {
                let sensor = Sensor::from_code(device)?;
                Report::Value(sensor, Report::value_of(sensor, payload)?)
            }
            0x11 => {
                let (axis, state) = Report::of_joint(payload)?;
                Report::Joint(axis, state)
            }
            0x12 => Report::Latch(Dock::from_index(device)?, latch::State::from_code(low)?),
            0x13 => Report::Lost(Dock::from_index(device)?),
            0x14 => Report::Switch(Dock::from_index(device)?, Switch::from_code(low)?),
            0x15 => Report::Battery(Level::from_code(low)?),
            0x16 => Report::Charger(charger::State::from_code(low)?),
            0x17 => Report::Refused(TaskCode::new(device)?),
            0x18 => Report::Kept(Report::kept(payload)?),
            0x19 => Report::Held(Dock::from_index(device)?),
            _ => return None,
        })
    }
}

const fn bool_from(byte: u8) -> Option<bool> {
    match byte {
        0 => Some(false),
        1 => Some(true),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::collections::HashSet;

    /// Reads every payload, as far as values are told apart. A request or report that is read, written and
    /// read again is the same, and no payload is both.
    #[test]
    fn every_payload_is_one_request_or_one_report_or_nothing() {
        let (mut requests, mut reports) = (HashSet::new(), HashSet::new());
        for kind in 0..=u8::MAX {
            for device in 0..=u8::MAX {
                for low in 0..=u8::MAX {
                    let payload = [kind, device, low, 0x81, 0x7f];
                    let request = Request::from_payload(&payload);
                    let report = Report::from_payload(&payload);
                    assert!(request.is_none() || report.is_none(), "{payload:?}");
                    if let Some(request) = request {
                        assert_eq!(Request::from_payload(&request.to_payload()), Some(request));
                        assert!(!request.task().is_behaviour());
                        requests.insert(request);
                    }
                    if let Some(sensor) = Sensor::from_code(device) {
                        let value =
                            Report::value_of(sensor, &payload).map(|value| Report::Value(sensor, value));
                        assert_eq!(value, report.filter(|report| matches!(report, Report::Value(..))));
                    }
                    let latched = |dock| Report::Latch(dock, latch::State::At(End::Latched));
                    let is_latched = Dock::ALL.into_iter().find(|dock| report == Some(latched(*dock)));
                    assert_eq!(Report::latched(&payload), is_latched);
                    if let Some(report) = report {
                        assert_eq!(Report::from_payload(&report.to_payload()), Some(report));
                        reports.insert(report);
                    }
                }
            }
        }
        assert_eq!(requests.len(), 19 + 2 * 3 * 256 + 3 + 6 * 2 + 6 + 6 * 2 + 2 + 2 * 4 + 256 * 256 + 6);
        assert_eq!(reports.len(), 19 * 256 + 3 * 5 + 6 * 8 + 2 * 6 + 6 * 4 + 4 + 5 + 32 + 256 * 256);
    }

    #[test]
    fn each_request_goes_to_its_device() {
        let (axis, dock, sensor) = (Axis::Roll, Dock::Left, Sensor::AccelerationY);
        let [joint, docking] = [TaskCode::joint(axis), TaskCode::dock(dock)];
        for (request, task) in [
            (Request::Read(sensor), TaskCode::ACCELEROMETER),
            (Request::Turn { axis, angle: 1, speed: 2 }, joint),
            (Request::TurnBy { axis, by: 1, speed: 2 }, joint),
            (Request::Relax(axis), joint),
            (Request::Latch(dock, End::Latched), docking),
            (Request::Approach(dock), docking),
            (Request::Leave(dock), docking),
            (Request::Power { dock, is_on: true }, docking),
            (Request::Charge { is_on: true }, TaskCode::POWER),
            (Request::Allow(Allowance::ALL), TaskCode::POWER_BEYOND),
            (Request::Keep([1, 2, 3, 4]), TaskCode::MEMORY),
        ] {
            assert_eq!(request.task(), task, "{request:?}");
        }
    }

    #[test]
    fn other_lengths_are_nothing() {
        for length in (0..=16).filter(|length| *length != LENGTH) {
            assert_eq!(Request::from_payload(&[0; 16][..length]), None);
            assert_eq!(Report::from_payload(&[0x10; 16][..length]), None);
        }
    }
}
