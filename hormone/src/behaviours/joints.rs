//! HORMONE's requests to the joints.

use tasks::motor::Axis;
use tasks::motor::joint::State;
use tasks::request::Request;

use crate::action::Posture;
use crate::module::Module;
use crate::time::until;

/// How fast joints turn, in degrees per second.
const SPEED: u8 = 60;

/// How long after the first failure joints that have failed are told their targets again, in ms. A joint in
/// the trunk always has the same target, so it would stay off for good once it failed. It fails when it bears
/// more than its motor can while other feet are in the air, or when a jolt lifts its potentiometer off its
/// track.
pub(super) const RETRY: u16 = 500;

/// The targets that the joints were told, by their indices, and which of the joints have failed since.
pub struct Joints {
    /// In degrees.
    told: [Option<i8>; 3],
    failed: [bool; 3],
    /// When failed joints are told their targets again.
    retry_at: u16,
}

impl Joints {
    /// No joint has been told anything yet.
    pub const fn new() -> Self {
        Joints { told: [None; 3], failed: [false; 3], retry_at: 0 }
    }

    /// Takes in the state of a joint. One that is off has forgotten its target: its MCU was reset, or another
    /// task relaxed it. It is told again at once, for a robot that stands may have no other target for it.
    /// HORMONE knows no target if the master was reset, too: then the joint is to stay where it is.
    pub fn hear(&mut self, now: u16, axis: Axis, state: State) {
        let index = usize::from(axis.index());
        let awaits_retry = self.failed.contains(&true);
        let Some(failed) = self.failed.get_mut(index) else { return };
        match state {
            State::Off => {
                *failed = true;
                self.retry_at = now;
            }
            State::Stalled | State::BrokenPotentiometer => {
                *failed = true;
                // Failures that follow may not put this off.
                if !awaits_retry {
                    self.retry_at = now.wrapping_add(RETRY);
                }
            }
            State::Moving | State::Arrived => {}
        }
    }

    /// Tells each joint its angle of `posture` if that is a new target. Repeats the targets of joints that
    /// have failed, if it is time for that. A request that finds no room is made again at the next call.
    pub fn turn(&mut self, now: u16, posture: Option<Posture>, module: &mut impl Module) {
        let is_retry = self.retry_in(now) == Some(0);
        let posture = posture.map(|Posture { motor0, roll, motor2 }| [motor0, roll, motor2]);
        for (index, axis) in Axis::ALL.into_iter().enumerate() {
            let (Some(told), Some(failed)) = (self.told.get_mut(index), self.failed.get_mut(index)) else {
                continue;
            };
            let target = posture.and_then(|posture| posture.get(index).copied()).or(*told);
            let has_to = *told != target || is_retry && *failed;
            if has_to && tell(axis, target, module) {
                (*told, *failed) = (target, false);
            }
        }
        if is_retry {
            // For requests that found no room.
            self.retry_at = now.wrapping_add(RETRY);
        }
    }

    /// Milliseconds from `now` until joints that have failed are told again; `None` if there are none.
    pub fn retry_in(&self, now: u16) -> Option<u16> {
        self.failed.contains(&true).then(|| until(self.retry_at, now))
    }
}

/// Has a joint turn to `target`, in degrees, or stay where it is. Returns whether there was room.
#[inline(never)] // else its message would lie under those that HORMONE sends
fn tell(axis: Axis, target: Option<i8>, module: &mut impl Module) -> bool {
    let request = match target {
        Some(degrees) => Request::Turn { axis, angle: i16::from(degrees) * 10, speed: SPEED },
        None => Request::TurnBy { axis, by: 0, speed: SPEED },
    };
    module.request(request).is_ok()
}

impl Default for Joints {
    fn default() -> Self {
        Self::new()
    }
}
