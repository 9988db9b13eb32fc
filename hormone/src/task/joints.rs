//! What HORMONE tells the joints.

use kernel::Task;
use tasks::api::Api;
use tasks::message::TaskCode;
use tasks::motor::Axis;
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

    /// Has each joint turn to its angle of `posture`, if that is news to it. What finds no room is told the next time.
    #[inline(never)] // else its message would lie under those that HORMONE sends
    pub fn turn(&mut self, task: &mut Task, api: Api, posture: Posture) {
        let angles = [posture.motor0, posture.roll, posture.motor2];
        for ((axis, degrees), told) in Axis::ALL.into_iter().zip(angles).zip(&mut self.told) {
            if *told == Some(degrees) {
                continue;
            }
            let angle = i16::from(degrees) * 10;
            if api.request(task, TaskCode::HORMONE, Request::Turn { axis, angle, speed: SPEED }).is_ok() {
                *told = Some(degrees);
            }
        }
    }
}

impl Default for Joints {
    fn default() -> Self {
        Self::new()
    }
}
