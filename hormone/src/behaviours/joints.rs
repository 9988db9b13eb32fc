//! What HORMONE tells the joints.

use tasks::motor::Axis;
use tasks::motor::joint::{Fault, State};
use tasks::request::Request;

use crate::action::Posture;
use crate::module::Module;

/// How fast joints turn, in degrees per second.
const SPEED: u8 = 60;

/// Where the joints were told to go, in degrees, by their indices.
pub struct Joints {
    told: [Option<i8>; 3],
    /// Which of them have stalled since the last beat.
    stalled: [bool; 3],
}

impl Joints {
    /// No joint was told anything.
    pub const fn new() -> Self {
        Joints { told: [None; 3], stalled: [false; 3] }
    }

    /// A joint that is off has forgotten what it was told: its MCU was reset, or somebody else relaxed it.
    pub fn hear(&mut self, axis: Axis, state: State) {
        let index = usize::from(axis.index());
        let (Some(told), Some(stalled)) = (self.told.get_mut(index), self.stalled.get_mut(index)) else {
            return;
        };
        match state {
            State::Off => *told = None,
            State::Failed(Fault::Stall) => *stalled = true,
            _ => {}
        }
    }

    /// A beat has come: joints that have stalled are told again. One in the trunk, which always has the same
    /// target, bears more than its motor does while other feet are in the air, and would stay off for good.
    #[inline(never)] // else it would take stack from what HORMONE calls
    pub fn retry(&mut self) {
        for (told, stalled) in self.told.iter_mut().zip(&mut self.stalled) {
            if core::mem::take(stalled) {
                *told = None;
            }
        }
    }

    /// Has each joint turn to its angle of `posture`, if that is news to it. What finds no room is told the
    /// next time.
    pub fn turn(&mut self, posture: Posture, module: &mut impl Module) {
        let [front, roll, back] = &mut self.told;
        tell(Axis::Front, posture.motor0, front, module);
        tell(Axis::Roll, posture.roll, roll, module);
        tell(Axis::Back, posture.motor2, back, module);
    }
}

#[inline(never)] // else its message would lie under those that HORMONE sends
fn tell(axis: Axis, degrees: i8, told: &mut Option<i8>, module: &mut impl Module) {
    if *told == Some(degrees) {
        return;
    }
    let angle = i16::from(degrees) * 10;
    if module.request(Request::Turn { axis, angle, speed: SPEED }).is_ok() {
        *told = Some(degrees);
    }
}

impl Default for Joints {
    fn default() -> Self {
        Self::new()
    }
}
