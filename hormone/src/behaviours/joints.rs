//! What HORMONE tells the joints.

use tasks::motor::Axis;
use tasks::motor::joint::State;
use tasks::request::Request;

use crate::action::Posture;
use crate::module::Module;
use crate::time::until;

/// How fast joints turn, in degrees per second.
const SPEED: u8 = 60;

/// How long after it failed a joint is told again, in ms. One in the trunk, which always has the same target,
/// bears more than its motor does while other feet are in the air, or has a potentiometer that a jolt lifts
/// off its track, and would stay off for good.
pub(super) const RETRY: u16 = 500;

/// Where the joints were told to go, by their indices, and which of them have failed since.
pub struct Joints {
    /// In degrees.
    told: [Option<i8>; 3],
    failed: [bool; 3],
    /// When those that have failed are told again.
    retry_at: u16,
}

impl Joints {
    /// No joint was told anything.
    pub const fn new() -> Self {
        Joints { told: [None; 3], failed: [false; 3], retry_at: 0 }
    }

    /// A joint that is off has forgotten what it was told: its MCU was reset, or somebody else relaxed it.
    pub fn hear(&mut self, now: u16, axis: Axis, state: State) {
        let index = usize::from(axis.index());
        let (Some(told), Some(failed)) = (self.told.get_mut(index), self.failed.get_mut(index)) else {
            return;
        };
        match state {
            State::Off => *told = None,
            State::Stalled | State::BrokenPotentiometer => {
                *failed = true;
                self.retry_at = now.wrapping_add(RETRY);
            }
            State::Moving | State::Arrived => {}
        }
    }

    /// Has each joint turn to its angle of `posture`, if that is news to it, and those that have failed turn
    /// where they were told to, if it is time for that. What finds no room is told the next time.
    pub fn turn(&mut self, now: u16, posture: Option<Posture>, module: &mut impl Module) {
        let is_retry = self.retry_in(now) == Some(0);
        let posture = posture.map(|Posture { motor0, roll, motor2 }| [motor0, roll, motor2]);
        for (index, axis) in Axis::ALL.into_iter().enumerate() {
            let (Some(told), Some(failed)) = (self.told.get_mut(index), self.failed.get_mut(index)) else {
                continue;
            };
            let target = posture.and_then(|posture| posture.get(index).copied()).or(*told);
            let has_to = *told != target || is_retry && *failed;
            if let Some(degrees) = target.filter(|_| has_to)
                && tell(axis, degrees, module)
            {
                (*told, *failed) = (Some(degrees), false);
            }
        }
        if is_retry {
            // For what found no room.
            self.retry_at = now.wrapping_add(RETRY);
        }
    }

    /// Milliseconds from `now` until joints that have failed are told again; `None` if there are none.
    pub fn retry_in(&self, now: u16) -> Option<u16> {
        self.failed.contains(&true).then(|| until(self.retry_at, now))
    }
}

/// Returns whether there was room.
#[inline(never)] // else its message would lie under those that HORMONE sends
fn tell(axis: Axis, degrees: i8, module: &mut impl Module) -> bool {
    module.request(Request::Turn { axis, angle: i16::from(degrees) * 10, speed: SPEED }).is_ok()
}

impl Default for Joints {
    fn default() -> Self {
        Self::new()
    }
}
