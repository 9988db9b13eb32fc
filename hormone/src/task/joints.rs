//! What HORMONE tells the joints.

use kernel::Task;
use tasks::api::Api;
use tasks::message::TaskCode;
use tasks::motor::Axis;
use tasks::motor::joint::State;
use tasks::request::Request;

use crate::action::Posture;

/// How fast joints turn, in degrees per second.
const SPEED: u8 = 60;

/// Where the joints were told to go, in degrees, by their indices.
pub struct Joints {
    told: [Option<i8>; 3],
}

impl Joints {
    /// No joint was told anything.
    pub const fn new() -> Self {
        Joints { told: [None; 3] }
    }

    /// A joint that is off has forgotten what it was told: its MCU was reset, or somebody else relaxed it.
    pub fn hear(&mut self, axis: Axis, state: State) {
        if state == State::Off
            && let Some(told) = self.told.get_mut(usize::from(axis.index()))
        {
            *told = None;
        }
    }

    /// Has each joint turn to its angle of `posture`, if that is news to it. What finds no room is told the
    /// next time.
    pub fn turn(&mut self, task: &mut Task, api: Api, posture: Posture) {
        let [front, roll, back] = &mut self.told;
        tell(task, api, Axis::Front, posture.motor0, front);
        tell(task, api, Axis::Roll, posture.roll, roll);
        tell(task, api, Axis::Back, posture.motor2, back);
    }
}

#[inline(never)] // else its message would lie under those that HORMONE sends
fn tell(task: &mut Task, api: Api, axis: Axis, degrees: i8, told: &mut Option<i8>) {
    if *told == Some(degrees) {
        return;
    }
    let angle = i16::from(degrees) * 10;
    if api.request(task, TaskCode::HORMONE, Request::Turn { axis, angle, speed: SPEED }).is_ok() {
        *told = Some(degrees);
    }
}

impl Default for Joints {
    fn default() -> Self {
        Self::new()
    }
}
